# Makes one script, or style sheet, of all that a page's imports:
#   webots_cloud_bundle(RESULT variable OUTPUT folder ROOT folder FILES all of the web ENTRIES page/page.js page/page.css ...
#                       SHOWN name=name ...)
# RESULT becomes a list of name=path, as webots_cloud_embed takes them, for the ENTRIES. A browser far away then asks once and not, import
# by import, for thirty files. esbuild does it, of the npm registry, which install_node_packages (cmake/packages/install.sh) puts into
# build/node. SHOWN: under which other names the servers show files. Without it or node the list is empty: pages work as they are, and load more slowly.
if(WEBOTS_CLOUD_ESBUILD AND NOT EXISTS ${WEBOTS_CLOUD_ESBUILD}) # it was there once
    unset(WEBOTS_CLOUD_ESBUILD CACHE)
endif()
find_file(WEBOTS_CLOUD_ESBUILD esbuild NO_DEFAULT_PATH
    PATHS ${PROJECT_SOURCE_DIR}/build/node/src/web/view/node_modules/esbuild/bin DOC "Program of the npm package esbuild")
find_program(WEBOTS_CLOUD_NODE NAMES node nodejs DOC "Program that runs esbuild")
mark_as_advanced(WEBOTS_CLOUD_ESBUILD WEBOTS_CLOUD_NODE)
cmake_path(GET WEBOTS_CLOUD_ESBUILD PARENT_PATH node_packages)
cmake_path(SET WEBOTS_CLOUD_NODE_PACKAGES NORMALIZE "${node_packages}/../..") # what scripts import by name

# Pages have the folder `view` in their own folder, as the servers show it to them, and modules of it find what is beside them (texts, the
# library of 3D) by their own addresses: in a bundle by that of the page's `view`.
function(webots_cloud_bundle)
    cmake_parse_arguments(BUNDLE "" "RESULT;OUTPUT;ROOT" "FILES;ENTRIES;SHOWN" ${ARGN})
    set(${BUNDLE_RESULT} "" PARENT_SCOPE)
    if(NOT WEBOTS_CLOUD_ESBUILD OR NOT WEBOTS_CLOUD_NODE)
        if(WEBOTS_CLOUD_BUILD_ADAPTERS)
            message(STATUS "esbuild is not installed: pages load file by file (see cmake/bundle.cmake)")
        endif()
        return()
    endif()
    set(sources ${BUNDLE_FILES})
    list(FILTER sources INCLUDE REGEX "\\.(js|css)$")
    set(staging ${BUNDLE_OUTPUT}/staging)
    foreach(source IN LISTS sources) # as links, so that builds see changes
        cmake_path(GET source PARENT_PATH folder)
        file(MAKE_DIRECTORY ${staging}/${folder})
        file(CREATE_LINK ${BUNDLE_ROOT}/${source} ${staging}/${source} SYMBOLIC)
    endforeach()
    foreach(pair IN LISTS BUNDLE_SHOWN)
        string(REPLACE "=" ";" pair "${pair}")
        list(GET pair 0 shown)
        list(GET pair 1 file)
        file(CREATE_LINK ${BUNDLE_ROOT}/${file} ${staging}/${shown} SYMBOLIC)
    endforeach()
    list(TRANSFORM sources PREPEND ${BUNDLE_ROOT}/ OUTPUT_VARIABLE paths)
    set(result "")
    foreach(entry IN LISTS BUNDLE_ENTRIES)
        cmake_path(GET entry PARENT_PATH folder)
        set(options "")
        if(NOT "${folder}" STREQUAL "view")
            string(REGEX MATCH "^[^/]+" page ${entry})
            file(CREATE_LINK ${staging}/view ${staging}/${page}/view SYMBOLIC)
            file(RELATIVE_PATH view_bundle /${folder} /${page}/view/bundle.js)
            if(entry MATCHES "\\.js$")
                set(options --define:import.meta.url=folderOfView
                    "--banner:js=const folderOfView = new URL('${view_bundle}', import.meta.url).href\;")
            endif()
        endif()
        add_custom_command(
            OUTPUT ${BUNDLE_OUTPUT}/${entry}
            COMMAND ${CMAKE_COMMAND} -E env NODE_PATH=${WEBOTS_CLOUD_NODE_PACKAGES}
                    ${WEBOTS_CLOUD_NODE} ${WEBOTS_CLOUD_ESBUILD} ${staging}/${entry} --bundle --minify --format=esm --charset=utf8
                    --preserve-symlinks --log-level=warning --outfile=${BUNDLE_OUTPUT}/${entry} ${options}
            DEPENDS ${paths} ${WEBOTS_CLOUD_ESBUILD}
            COMMENT "Bundling ${entry}"
            VERBATIM)
        list(APPEND result ${entry}=${BUNDLE_OUTPUT}/${entry})
    endforeach()
    set(${BUNDLE_RESULT} ${result} PARENT_SCOPE)
endfunction()
