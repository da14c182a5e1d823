// Which mounts lie inside a directory.
#include "unit_test.hpp"

#include "adapters/files/mounts.hpp"

using webots_cloud::adapters::mounts_below;

BOOST_AUTO_TEST_SUITE(mounts)

namespace {

constexpr std::string_view mountinfo =
    "22 1 8:1 / / rw,relatime - ext4 /dev/sda1 rw\n"
    "30 22 0:25 / /tmp/instances/1/robots rw,nosuid - overlay overlay rw,lowerdir=x\n"
    "31 22 0:26 / /tmp/instances/10/robots rw - overlay overlay rw\n"
    "32 30 0:27 / /tmp/instances/1/robots/inner rw - tmpfs tmpfs rw\n"
    "33 22 0:28 / /tmp/instances/2/my\\040robots\\134 rw - overlay overlay rw\n"
    "34 22 0:29 / /tmp/instances/3 rw - tmpfs tmpfs rw\n"
    "broken line\n";

} // namespace

BOOST_AUTO_TEST_CASE(mounts_below_a_directory_are_listed_the_innermost_first)
{
    auto const found = mounts_below(mountinfo, "/tmp/instances/1");
    BOOST_TEST(found ==
                   (std::vector<std::string>{"/tmp/instances/1/robots/inner", "/tmp/instances/1/robots"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_mount_on_the_directory_itself_counts)
{
    BOOST_TEST(mounts_below(mountinfo, "/tmp/instances/3").size() == 1u);
}

BOOST_AUTO_TEST_CASE(escaped_characters_are_understood)
{
    auto const found = mounts_below(mountinfo, "/tmp/instances/2");
    BOOST_REQUIRE(found.size() == 1u);
    BOOST_TEST(found.front() == "/tmp/instances/2/my robots\\");
}

BOOST_AUTO_TEST_CASE(nothing_is_below_other_directories)
{
    BOOST_TEST(mounts_below(mountinfo, "/tmp/instances/4").empty());
    BOOST_TEST(mounts_below(mountinfo, "/tmp/inst").empty());
    BOOST_TEST(mounts_below("", "/tmp").empty());
}

BOOST_AUTO_TEST_SUITE_END()
