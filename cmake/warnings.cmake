# Warnings of our own code only: linked PRIVATE, never part of what a consumer sees.
add_library(webots_cloud_warnings INTERFACE)
target_compile_options(webots_cloud_warnings INTERFACE
    -Wall -Wextra -Wpedantic -Wold-style-cast -Woverloaded-virtual
    $<$<CXX_COMPILER_ID:GNU>:-Wshadow=local>
    # Coroutine frames of Asio's awaitable come from a class operator new and go to its operator delete, but where
    # g++ inlines one of the two only it believes that they do not belong together.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-mismatched-new-delete>)
