# What is installed, and the package that find_package(webots_cloud) finds. Each component has an export file of its own, so
# that a project that asks for core alone needs none of the libraries behind the adapters.
#
# COMPONENT says in which Debian package a file is (cmake/debian.cmake); cmake --install installs them all. The component
# without_package is for what packages have elsewhere or in another form.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/webots_cloud)
set(data_dir ${CMAKE_INSTALL_DATADIR}/webots_cloud)

function(webots_cloud_install_library target component)
    install(TARGETS ${target} EXPORT webots_cloud-${component}
        ARCHIVE COMPONENT dev
        LIBRARY COMPONENT dev
        RUNTIME COMPONENT dev
        FILE_SET HEADERS COMPONENT dev)
    install(EXPORT webots_cloud-${component} NAMESPACE webots_cloud:: DESTINATION ${package_dir}
        FILE webots_cloud-${component}.cmake COMPONENT dev)
endfunction()

webots_cloud_install_library(webots_cloud_core core)
webots_cloud_install_library(webots_cloud_testing testing)
if(WEBOTS_CLOUD_BUILD_ADAPTERS)
    webots_cloud_install_library(webots_cloud webots_cloud)
    install(TARGETS webots-process-guard RUNTIME COMPONENT simulation_server)
endif()
if(BUILD_SHARED_LIBS)
    install(TARGETS webots_cloud_shared EXPORT webots_cloud-shared LIBRARY COMPONENT shared NAMELINK_COMPONENT dev)
    install(EXPORT webots_cloud-shared NAMESPACE webots_cloud:: DESTINATION ${package_dir} FILE webots_cloud-shared.cmake COMPONENT dev)
endif()

# Static libraries: who links them must use the very Boost that they were compiled with.
find_package(Boost 1.81 REQUIRED)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/webots_cloudConfig.cmake.in
    ${PROJECT_BINARY_DIR}/webots_cloudConfig.cmake INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO
    NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/webots_cloudConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${PROJECT_BINARY_DIR}/webots_cloudConfig.cmake ${PROJECT_BINARY_DIR}/webots_cloudConfigVersion.cmake
    DESTINATION ${package_dir} COMPONENT dev)

# For pkg-config. The prefix is found from where the file lies, since cmake --install can be told another one.
if(IS_ABSOLUTE ${CMAKE_INSTALL_LIBDIR} OR IS_ABSOLUTE ${CMAKE_INSTALL_INCLUDEDIR})
    set(pc_prefix ${CMAKE_INSTALL_PREFIX})
    set(pc_libdir ${CMAKE_INSTALL_FULL_LIBDIR})
    set(pc_includedir ${CMAKE_INSTALL_FULL_INCLUDEDIR})
else()
    file(RELATIVE_PATH up /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
    set(pc_prefix "\${pcfiledir}/${up}")
    set(pc_libdir "\${prefix}/${CMAKE_INSTALL_LIBDIR}")
    set(pc_includedir "\${prefix}/${CMAKE_INSTALL_INCLUDEDIR}")
endif()
set(package_configs webots_cloud_core)
if(WEBOTS_CLOUD_BUILD_ADAPTERS)
    list(APPEND package_configs webots_cloud_static)
endif()
if(BUILD_SHARED_LIBS)
    list(APPEND package_configs webots_cloud)
endif()
foreach(name IN LISTS package_configs)
    configure_file(${CMAKE_CURRENT_LIST_DIR}/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT dev)
endforeach()

# The servers look for their default configuration in share/webots_cloud, and local.json for the demo projects beside it.
if(WEBOTS_CLOUD_BUILD_APPS)
    foreach(kind session simulation)
        install(TARGETS webots-${kind}-server RUNTIME COMPONENT ${kind}_server)
        install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/${kind} DESTINATION ${data_dir}/config COMPONENT ${kind}_server)
        install(FILES ${PROJECT_SOURCE_DIR}/config/${kind}.schema.json DESTINATION ${data_dir}/config COMPONENT ${kind}_server)
    endforeach()
    foreach(neighbour apache grafana nginx prometheus)
        install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/${neighbour} DESTINATION ${data_dir}/config COMPONENT session_server)
    endforeach()
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/systemd ${PROJECT_SOURCE_DIR}/config/website_host
        DESTINATION ${data_dir}/config COMPONENT without_package)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/demo_projects DESTINATION ${data_dir}/examples COMPONENT demo)
endif()
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT without_package)

# What headers refer to. Links from page to page work: the folders are those of the source.
set(doc_dir ${CMAKE_INSTALL_DATADIR}/doc/webots-cloud-doc)
foreach(page README ARCHITECTURE CONTRIBUTING HACKING SECURITY)
    install(FILES ${PROJECT_SOURCE_DIR}/${page}.md DESTINATION ${doc_dir} COMPONENT doc)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${doc_dir} COMPONENT doc PATTERN site EXCLUDE)
file(GLOB examples CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/examples/*.cpp)
set(examples_dir ${CMAKE_INSTALL_DATADIR}/doc/libwebots-cloud-dev/examples)
install(FILES ${examples} DESTINATION ${examples_dir} COMPONENT dev)
install(FILES ${CMAKE_CURRENT_LIST_DIR}/debian/examples.cmake DESTINATION ${examples_dir} RENAME CMakeLists.txt COMPONENT dev)
