#include "unit_test.hpp"

#include "core/docker/docker_engine.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(docker_engine)

BOOST_AUTO_TEST_CASE(containers_run_by_nvidia_where_there_is_that)
{
    struct Answer
    {
        char const* info;
        char const* runtime; ///< Empty: the daemon did not answer.
    };
    Answer const answers[] = {
        {"Docker 26.1.5 has io.containerd.runc.v2 runc \n", "runc"},
        {"Docker 20.10.24 has nvidia runc \n", "nvidia"},
        {"Docker 20.10.24 has runc nvidia \n", "nvidia"},
        {"Docker 20.10.24 has nvidia-legacy runc \n", "runc"},
        {"WARNING: No swap limit support\nDocker 26.1.5 has runc \nWARNING: x\n", "runc"},
        {"Docker 26.1.5 has \n", "runc"},
        {"Docker 26.1.5 has runc with name=seccomp,profile=builtin \n", "runc"},
        {"Docker  has \n", ""}, // with status 0
        {"Docker  has \nWARNING: No swap limit support\n", ""},
        {"", ""},
        {"nvidia \n", ""},
    };
    for (auto const& [info, runtime] : answers)
        BOOST_TEST(parse_container_runtime(info).value_or("") == runtime, info);
}

BOOST_AUTO_TEST_CASE(builds_are_confined_by_a_list_of_system_calls_or_users_of_the_engine)
{
    for (auto const* info :
         {"Docker 20.10.24 has runc with name=seccomp,profile=/etc/webots-cloud/docker/seccomp.json \n",
          "WARNING: x\nDocker 26.1.5 has runc with name=apparmor name=seccomp,profile=builtin name=userns \n",
          "Docker 26.1.5 has runc with name=seccomp,profile=builtin name=rootless name=cgroupns\n"})
        BOOST_TEST(confines_builds(info), info);
    for (auto const* info :
         {"Docker 20.10.24 has runc with name=seccomp,profile=default \n",
          "Docker 26.1.5 has runc with name=apparmor name=seccomp,profile=builtin name=cgroupns \n",
          "Docker 26.1.5 has runc with name=seccomp,profile=unconfined \n",
          "Docker 26.1.5 has runc with name=seccomp,profile= \n", "Docker 26.1.5 has runc with \n", ""})
        BOOST_TEST(!confines_builds(info), info);
}

BOOST_AUTO_TEST_SUITE_END()
