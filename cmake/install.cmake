# What is installed, and the package that find_package(webots_cloud) finds. Each component has an export file of its own, so
# that a project that asks for core alone needs none of the libraries behind the adapters.
include(CMakePackageConfigHelpers)

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/webots_cloud)
set(data_dir ${CMAKE_INSTALL_DATADIR}/webots_cloud)

function(webots_cloud_install_library target component)
    install(TARGETS ${target} EXPORT webots_cloud-${component} ARCHIVE LIBRARY RUNTIME FILE_SET HEADERS)
    install(EXPORT webots_cloud-${component} NAMESPACE webots_cloud:: DESTINATION ${package_dir}
        FILE webots_cloud-${component}.cmake)
endfunction()

webots_cloud_install_library(webots_cloud_core core)
webots_cloud_install_library(webots_cloud_testing testing)
if(WEBOTS_CLOUD_BUILD_ADAPTERS)
    webots_cloud_install_library(webots_cloud webots_cloud)
    install(TARGETS webots-process-guard)
endif()
if(BUILD_SHARED_LIBS)
    webots_cloud_install_library(webots_cloud_shared shared)
endif()

# Static libraries: who links them must use the very Boost that they were compiled with.
find_package(Boost 1.81 REQUIRED)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/webots_cloudConfig.cmake.in
    ${PROJECT_BINARY_DIR}/webots_cloudConfig.cmake INSTALL_DESTINATION ${package_dir} NO_SET_AND_CHECK_MACRO
    NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/webots_cloudConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/webots_cloudConfig.cmake ${PROJECT_BINARY_DIR}/webots_cloudConfigVersion.cmake
    DESTINATION ${package_dir})

# For pkg-config. Folders below the prefix are named by it, so that the prefix can be given at installation (pkg-config --define-prefix).
foreach(folder LIBDIR INCLUDEDIR)
    string(TOLOWER pc_${folder} variable)
    cmake_path(IS_ABSOLUTE CMAKE_INSTALL_${folder} is_absolute)
    if(is_absolute)
        set(${variable} ${CMAKE_INSTALL_${folder}})
    else()
        set(${variable} "\${prefix}/${CMAKE_INSTALL_${folder}}")
    endif()
endforeach()
set(package_configs webots_cloud_core)
if(WEBOTS_CLOUD_BUILD_ADAPTERS)
    list(APPEND package_configs webots_cloud)
endif()
foreach(name IN LISTS package_configs)
    configure_file(${CMAKE_CURRENT_LIST_DIR}/${name}.pc.in ${PROJECT_BINARY_DIR}/${name}.pc @ONLY)
    install(FILES ${PROJECT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()

# The servers look for their default configuration in share/webots_cloud, and local.json for the demo projects beside it.
if(WEBOTS_CLOUD_BUILD_APPS)
    install(TARGETS webots-session-server webots-simulation-server)
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/config DESTINATION ${data_dir})
    install(DIRECTORY ${PROJECT_SOURCE_DIR}/examples/demo_projects DESTINATION ${data_dir}/examples)
endif()
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
