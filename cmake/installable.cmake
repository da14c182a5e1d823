# The target `installable` builds what is installed. Where a part of it is missing nothing is installed or packaged at all: half a prefix looks
# like a whole one. Its rule comes first, so that it is checked before anything is copied.
set(installed webots_cloud_core webots_cloud_testing)
if(WEBOTS_CLOUD_BUILD_ADAPTERS)
    list(APPEND installed webots_cloud webots-process-guard)
endif()
if(BUILD_SHARED_LIBS)
    list(APPEND installed webots_cloud_shared)
endif()
if(WEBOTS_CLOUD_BUILD_APPS)
    list(APPEND installed webots-session-server webots-simulation-server)
endif()
if(WEBOTS_CLOUD_BUILD_EXAMPLES)
    list(APPEND installed webots-demo-simulator)
endif()
add_custom_target(installable)
add_dependencies(installable ${installed})
if(WEBOTS_CLOUD_BUILD_APPS)
    add_dependencies(installable manuals)
endif()
if(TARGET webots-website-host) # started by server.sh, and not installed: it is an example
    add_dependencies(installable webots-website-host)
endif()

foreach(target ${installed})
    list(APPEND installed_files $<TARGET_FILE:${target}>)
endforeach()
if(WEBOTS_CLOUD_BUILD_APPS) # one of what src/manual writes stands for all
    list(APPEND installed_files ${PROJECT_BINARY_DIR}/manuals/man/webots-session-server.8)
endif()
install(CODE "
foreach(file ${installed_files})
    if(NOT EXISTS \"\${file}\")
        message(FATAL_ERROR \"Nothing is installed, because \${file} is not built yet. \"
                \"First: cmake --build ${PROJECT_BINARY_DIR} --target installable\")
    endif()
endforeach()" ALL_COMPONENTS)
unset(installed)
unset(installed_files)
