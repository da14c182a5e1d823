# Code of the libraries is hidden but for what public headers declare (include/webots_cloud/export.hpp), and it can be linked into shared
# objects of others, such as modules of Python.
function(webots_cloud_visibility target)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
    # What is exported is still called directly from within, as in the static library.
    target_compile_options(${target} PRIVATE -fno-semantic-interposition)
endfunction()
