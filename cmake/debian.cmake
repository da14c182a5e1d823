# Debian packages, made by CPack from the components of cmake/install.cmake:
#   cmake --build --preset release --target installable && cpack --preset release
# They go to <build folder>/packages. Their maintainer scripts and lists of configuration files are in cmake/debian/<component>.
if(NOT WEBOTS_CLOUD_BUILD_APPS OR NOT WEBOTS_CLOUD_BUILD_EXAMPLES)
    return()
endif()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME webots-cloud)
set(CPACK_PACKAGE_VENDOR "webots_cloud")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package has its own; CPack would put one for all in front
set(maintainer "local build <local-build@webots-cloud.invalid>")
if(DEFINED ENV{DEBEMAIL})
    set(maintainer "$ENV{DEBFULLNAME} <$ENV{DEBEMAIL}>")
endif()
set(WEBOTS_CLOUD_MAINTAINER ${maintainer} CACHE STRING "Who answers for the packages: Name <address>. Like Debian's tools, DEBFULLNAME and DEBEMAIL say it, too.")
set(CPACK_PACKAGE_CONTACT ${WEBOTS_CLOUD_MAINTAINER})
# The forge of the checkout, where it has one; otherwise that of Webots, whose simulations it shows.
set(homepage https://cyberbotics.com)
find_package(Git QUIET)
if(GIT_FOUND)
    execute_process(COMMAND ${GIT_EXECUTABLE} -C ${PROJECT_SOURCE_DIR} remote get-url origin OUTPUT_VARIABLE origin ERROR_QUIET
        OUTPUT_STRIP_TRAILING_WHITESPACE)
    string(REGEX REPLACE "^git@([^:]+):" "https://\\1/" origin "${origin}")
    if(origin MATCHES "^https://([^@/]+/.+)$")
        string(REGEX REPLACE "\\.git$" "" homepage ${origin})
    endif()
endif()
set(WEBOTS_CLOUD_HOMEPAGE ${homepage} CACHE STRING "Where people who have a package read on. The forge of this checkout, if that is known.")
set(CPACK_DEBIAN_PACKAGE_HOMEPAGE ${WEBOTS_CLOUD_HOMEPAGE})
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_SET_DESTDIR ON) # files in /etc
set(CPACK_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL session_server simulation_server demo doc dev)
if(BUILD_SHARED_LIBS)
    list(APPEND CPACK_COMPONENTS_ALL shared)
endif()

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CMAKE_SKIP_PACKAGE_ALL_DEPENDENCY ON) # the target `package` is not to build the tests

set(debian_version ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})
set(debian_dir ${PROJECT_BINARY_DIR}/debian)
string(TIMESTAMP debian_date "%a, %d %b %Y %H:%M:%S +0000" UTC)

# webots_cloud_debian_package(COMPONENT PACKAGE SECTION SUMMARY DESCRIPTION): name and texts, and the files of a component that only a
# package has.
macro(webots_cloud_debian_package component name_of_package section summary description)
    set(package ${name_of_package}) # configure_file sees no arguments of macros
    string(TOUPPER ${component} upper)
    set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
    set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
    set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${description}")
    configure_file(${CMAKE_CURRENT_LIST_DIR}/debian/changelog.in ${debian_dir}/${package}/changelog.Debian @ONLY)
    foreach(changelog ${debian_dir}/${package}/changelog.Debian ${PROJECT_SOURCE_DIR}/CHANGELOG.md)
        get_filename_component(name ${changelog} NAME)
        string(REPLACE CHANGELOG.md changelog name ${name})
        execute_process(COMMAND gzip -9 --no-name --stdout ${changelog} OUTPUT_FILE ${debian_dir}/${package}/${name}.gz
            COMMAND_ERROR_IS_FATAL ANY)
        install(FILES ${debian_dir}/${package}/${name}.gz DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${component}
            EXCLUDE_FROM_ALL)
    endforeach()
    install(FILES ${CMAKE_CURRENT_LIST_DIR}/debian/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package}
        COMPONENT ${component} EXCLUDE_FROM_ALL)
    set(lintian_overrides)
    if(EXISTS ${CMAKE_CURRENT_LIST_DIR}/debian/${component}/lintian-overrides)
        file(READ ${CMAKE_CURRENT_LIST_DIR}/debian/${component}/lintian-overrides lintian_overrides)
    endif()
    configure_file(${CMAKE_CURRENT_LIST_DIR}/debian/lintian-overrides.in ${debian_dir}/${package}/lintian-overrides @ONLY)
    install(FILES ${debian_dir}/${package}/lintian-overrides DESTINATION ${CMAKE_INSTALL_DATADIR}/lintian/overrides RENAME ${package}
        COMPONENT ${component} EXCLUDE_FROM_ALL)
    set(control ${CMAKE_CURRENT_LIST_DIR}/debian/${component})
    file(GLOB CPACK_DEBIAN_${upper}_PACKAGE_CONTROL_EXTRA ${control}/conffiles ${control}/p*)
endmacro()

webots_cloud_debian_package(session_server webots-cloud-session-server net
    "sends browsers to machines that run Webots simulations"
    "The session server of a site with Webots robot simulations on the web:
it knows the machines that run simulations, sends each browser to the
best one, and serves the pages on which simulations are started, shown
and watched over.")
webots_cloud_debian_package(simulation_server webots-cloud-simulation-server net
    "runs Webots simulations for browsers"
    "The simulation server of a site with Webots robot simulations on the
web: it fetches projects, runs each simulation in a sandbox of its own,
and connects browsers to it. Webots itself is not included.")
webots_cloud_debian_package(demo webots-cloud-demo net
    "demo simulator and projects for webots_cloud"
    "A small simulator that a simulation server runs where Webots is not
installed, so that a site can be tried. It shows a few robots in an
arena and is not Webots. With projects for it and for Webots.")
webots_cloud_debian_package(doc webots-cloud-doc doc
    "documentation of webots_cloud"
    "How sites with Webots robot simulations on the web are installed, opened
to others and looked after, how pages and programs embed simulations, the
protocol, and how the servers work. Pages in Markdown.")
webots_cloud_debian_package(dev libwebots-cloud-dev libdevel
    "robot simulations on the web - C++ library"
    "Headers, libraries, examples and the CMake package of webots_cloud, for
programs that schedule, run or serve simulations themselves.")

if(BUILD_SHARED_LIBS)
    set(shared_package libwebots-cloud${webots_cloud_soversion})
    webots_cloud_debian_package(shared ${shared_package} libs
        "robot simulations on the web - shared library"
        "What programs need at run time that schedule, run or serve simulations
themselves with the shared library of webots_cloud.")
    # CPack calls ldconfig in maintainer scripts of its own, which dpkg does by a trigger now.
    set(CPACK_POST_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/debian/drop_ldconfig.cmake)
    set(control ${debian_dir}/${shared_package})
    file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
    file(WRITE ${control}/shlibs "libwebots_cloud ${webots_cloud_soversion} ${shared_package} (>= ${PROJECT_VERSION})\n")
    set(CPACK_DEBIAN_SHARED_PACKAGE_CONTROL_EXTRA ${control}/triggers ${control}/shlibs)
endif()

set(CPACK_DEBIAN_SESSION_SERVER_PACKAGE_DEPENDS "init-system-helpers (>= 1.54), systemd | systemd-standalone-sysusers")
set(CPACK_DEBIAN_SESSION_SERVER_PACKAGE_RECOMMENDS "ca-certificates, webots-cloud-doc")
set(CPACK_DEBIAN_SESSION_SERVER_PACKAGE_SUGGESTS webots-cloud-simulation-server)
set(CPACK_DEBIAN_SIMULATION_SERVER_PACKAGE_DEPENDS ${CPACK_DEBIAN_SESSION_SERVER_PACKAGE_DEPENDS})
# The sandbox of simulations, their way to the internet, a display for each, and what stands in for Webots.
set(CPACK_DEBIAN_SIMULATION_SERVER_PACKAGE_RECOMMENDS
    "bubblewrap, ca-certificates, iproute2, slirp4netns, webots-cloud-demo, webots-cloud-doc, xvfb")
set(CPACK_DEBIAN_SIMULATION_SERVER_PACKAGE_SUGGESTS "docker.io, webots, webots-cloud-session-server")
set(CPACK_DEBIAN_DEMO_PACKAGE_ENHANCES webots-cloud-simulation-server)
set(CPACK_DEBIAN_DEMO_PACKAGE_RECOMMENDS python3) # for the programs of robots
set(CPACK_DEBIAN_DEMO_PACKAGE_SUGGESTS "g++, make") # the same in C and C++

# Static libraries need at the next link what they were compiled with: cmake/webots_cloudConfig.cmake.in looks for these.
set(boost ${Boost_VERSION_MAJOR}.${Boost_VERSION_MINOR})
set(CPACK_DEBIAN_DEV_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libarchive-dev, libboost${boost}-dev, libboost-json${boost}-dev, \
libboost-url${boost}-dev, libc-ares-dev, libcurl4-openssl-dev, libgit2-dev, libspdlog-dev, libssl-dev, \
pkgconf, zlib1g-dev")
if(BUILD_SHARED_LIBS)
    string(APPEND CPACK_DEBIAN_DEV_PACKAGE_DEPENDS ", ${shared_package} (= ${debian_version})")
endif()

set(CPACK_DEBIAN_DEV_PACKAGE_RECOMMENDS webots-cloud-doc)

set(CPACK_DEBIAN_DOC_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DOC_PACKAGE_SHLIBDEPS OFF)

# Units for /usr; config/systemd has those for /usr/local.
foreach(kind session simulation)
    set(unit webots-${kind}-server)
    file(READ ${PROJECT_SOURCE_DIR}/config/systemd/${unit}.service text)
    string(REPLACE /usr/local/bin/ /usr/bin/ text "${text}")
    file(CONFIGURE OUTPUT ${debian_dir}/${unit}.service CONTENT "${text}" @ONLY)
    install(FILES ${debian_dir}/${unit}.service DESTINATION lib/systemd/system COMPONENT ${kind}_server EXCLUDE_FROM_ALL)
    install(FILES ${PROJECT_SOURCE_DIR}/config/systemd/${unit}.conf DESTINATION lib/sysusers.d COMPONENT ${kind}_server
        EXCLUDE_FROM_ALL)
    install(FILES ${PROJECT_SOURCE_DIR}/config/${kind}/installed.json DESTINATION /etc/webots-cloud RENAME ${kind}.json
        COMPONENT ${kind}_server EXCLUDE_FROM_ALL)
endforeach()

# Under its usual name CMake would make a target of it, whose command it does not quote: with a $ in the name of the folder
# nothing is built then (CMake 3.31).
set(CPACK_SOURCE_OUTPUT_CONFIG_FILE ${PROJECT_BINARY_DIR}/cpack_of_sources.cmake)
include(CPack)
