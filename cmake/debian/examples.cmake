# Builds the examples with the installed library: cmake -S /usr/share/doc/libwebots-cloud-dev/examples -B build && cmake --build build
cmake_minimum_required(VERSION 3.25...3.31)
project(webots_cloud_examples LANGUAGES CXX)

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
find_package(webots_cloud REQUIRED COMPONENTS core OPTIONAL_COMPONENTS webots_cloud)

foreach(example 01_schedule 03_own_transport 06_own_policy 08_behind_your_server)
    add_executable(${example} ${example}.cpp)
    target_link_libraries(${example} PRIVATE webots_cloud::core)
endforeach()
if(TARGET webots_cloud::webots_cloud)
    foreach(example 02_monitor_with_callbacks 04_run_a_simulation 05_embed_both 07_session_server)
        add_executable(${example} ${example}.cpp)
        target_link_libraries(${example} PRIVATE webots_cloud::webots_cloud)
    endforeach()
endif()
