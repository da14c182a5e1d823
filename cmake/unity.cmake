# Compiles the files of each folder of a library together, which takes half the time of compiling each alone: most of it goes into the headers
# and templates that they share. So do releases, which people build from nothing, and the sanitizers. The preset `dev` compiles each file
# alone, so that every file is known to include what it needs, and a change costs little.
option(WEBOTS_CLOUD_UNITY_BUILD "Compile the files of each folder of the library as one" OFF)

# Of one compilation: more would take more than 1 GB of memory, and leave nothing to do side by side.
set(webots_cloud_unity_batch 20)

# webots_cloud_unity_together(FOLDER ...): the files of these folders are compiled as if all were in the first, for folders that are
# smaller than a compilation should be. Comes before webots_cloud_unity_build.
function(webots_cloud_unity_together first)
    foreach(folder IN LISTS ARGN)
        set(webots_cloud_unity_place_of_${folder} ${first} PARENT_SCOPE)
    endforeach()
endfunction()

# webots_cloud_runs_seldom(FOLDER ...): what runs when a program starts, or once in a while, is compiled with -O1 in releases, which takes
# three quarters of the time. Comes before webots_cloud_unity_build.
function(webots_cloud_runs_seldom)
    set(webots_cloud_seldom ${ARGN} PARENT_SCOPE)
endfunction()

# webots_cloud_unity_build(TARGET [ALONE]): ALONE is a regular expression of the files that are compiled alone even so. Files that have a
# UNITY_GROUP already keep it.
function(webots_cloud_unity_build target)
    if(NOT WEBOTS_CLOUD_UNITY_BUILD)
        return()
    endif()
    get_target_property(sources ${target} SOURCES)
    list(FILTER sources INCLUDE REGEX "^[^/].*\\.cpp$") # not what is written while building
    if(ARGC GREATER 1)
        set(alone ${sources})
        list(FILTER alone INCLUDE REGEX "${ARGV1}")
        set_source_files_properties(${alone} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
        list(FILTER sources EXCLUDE REGEX "${ARGV1}")
    endif()
    foreach(source IN LISTS sources)
        cmake_path(GET source PARENT_PATH folder)
        get_source_file_property(group ${source} UNITY_GROUP)
        if(NOT group)
            if(DEFINED webots_cloud_unity_place_of_${folder})
                set(folder ${webots_cloud_unity_place_of_${folder}})
            endif()
            string(MAKE_C_IDENTIFIER "files_of_${folder}" count)
            if(NOT DEFINED ${count})
                set(${count} 0)
            endif()
            math(EXPR batch "${${count}} / ${webots_cloud_unity_batch} + 1")
            math(EXPR ${count} "${${count}} + 1")
            set(group "${folder}_${batch}")
            set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${group}")
        endif()
        if(folder IN_LIST webots_cloud_seldom)
            set_source_files_properties("${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${target}.dir/Unity/unity_${group}_cxx.cxx"
                PROPERTIES COMPILE_OPTIONS "$<$<CONFIG:Release>:-O1>")
        endif()
    endforeach()
    # It warns of headers, which may not name what another file has to itself: here there are only .cpp files.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# A program that calls one function of a folder is linked with all of it: what no program calls is left out again, a fifth of a server.
add_compile_options("$<$<CONFIG:Release>:-ffunction-sections;-fdata-sections>")
add_link_options("$<$<CONFIG:Release>:LINKER:--gc-sections>")
