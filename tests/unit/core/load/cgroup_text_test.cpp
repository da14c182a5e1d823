#include "unit_test.hpp"

#include "core/load/cgroup_text.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(cgroup_text)

BOOST_AUTO_TEST_CASE(our_group_of_version_2_is_the_line_without_controllers)
{
    BOOST_TEST(own_cgroup("0::/system.slice/x.service\n") == "/system.slice/x.service");
    BOOST_TEST(own_cgroup("2:cpu:/x\n0::/\n") == "/");
    BOOST_TEST(own_cgroup("2:cpu:/x\n") == "");
    BOOST_TEST(own_cgroup("") == "");
}

BOOST_AUTO_TEST_CASE(our_group_of_version_1_is_the_line_of_the_controller)
{
    constexpr auto* text = "4:memory:/a\n3:cpu,cpuacct:/b:c\n2:name=systemd:/d\n0::/e\n1\n";
    BOOST_TEST(own_cgroup(text, "memory") == "/a");
    BOOST_TEST(own_cgroup(text, "cpu") == "/b:c");
    BOOST_TEST(own_cgroup(text, "cpuacct") == "/b:c");
    BOOST_TEST(own_cgroup(text, "cpuset") == "");
}

BOOST_AUTO_TEST_CASE(a_limit_of_processors_is_quota_over_period)
{
    BOOST_TEST(processor_limit("150000 100000\n").value() == 1.5);
    for (auto const* text : {"max 100000\n", "", "5", "5 0", "x y", " "})
        BOOST_TEST(!processor_limit(text).has_value(), text);
}

BOOST_AUTO_TEST_CASE(numbers_and_keys_are_found_or_not)
{
    BOOST_TEST(cgroup_number("17\n").value() == 17u);
    for (auto const* text : {"max\n", "", "-1", "12x", "99999999999999999999"})
        BOOST_TEST(!cgroup_number(text).has_value(), text);
    BOOST_TEST(cgroup_value("a 1\nab 2\nabc 3", "ab") == 2u);
    BOOST_TEST(cgroup_value("a 1\n", "b") == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
