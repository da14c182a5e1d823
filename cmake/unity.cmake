# Compiles the files of each folder of a library as one: half the time for builds from nothing, such as those of the sanitizers. Builds for
# development and releases compile each file alone, so that every file is known to include what it needs, and a change costs little.
option(WEBOTS_CLOUD_UNITY_BUILD "Compile the files of each folder of the library as one" OFF)

# webots_cloud_unity_build(TARGET [ALONE]): ALONE is a regular expression of the files that are compiled alone even so.
function(webots_cloud_unity_build target)
    if(NOT WEBOTS_CLOUD_UNITY_BUILD)
        return()
    endif()
    get_target_property(sources ${target} SOURCES)
    list(FILTER sources INCLUDE REGEX "\\.cpp$")
    if(ARGC GREATER 1)
        set(alone ${sources})
        list(FILTER alone INCLUDE REGEX "${ARGV1}")
        set_source_files_properties(${alone} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
    endif()
    foreach(source IN LISTS sources)
        cmake_path(GET source PARENT_PATH folder)
        set_source_files_properties(${source} PROPERTIES UNITY_GROUP "${folder}")
    endforeach()
    # It warns of headers, which may not name what another file has to itself: here there are only .cpp files.
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
