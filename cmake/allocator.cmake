# malloc without locks, for programs whose event loop shares its memory with threads that have stepped back; why:
# docs/decisions/002-one-thread.md. Sanitizers bring a malloc of their own.
cmake_dependent_option(WEBOTS_CLOUD_MIMALLOC "Let the simulation server allocate with mimalloc"
    ON "NOT CMAKE_CXX_FLAGS MATCHES fsanitize" OFF)
add_library(webots_cloud_allocator INTERFACE)
if(WEBOTS_CLOUD_MIMALLOC)
    find_package(mimalloc REQUIRED)
    target_link_libraries(webots_cloud_allocator INTERFACE mimalloc)
endif()
