#include "unit_test.hpp"

#include "core/sandbox/subordinate_range.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(subordinate_range)

namespace {

result<SubordinateRange> find(std::string_view users, std::string_view groups,
                              std::string_view name = "webots", bool installed = true)
{
    SubordinateContext context;
    context.user = 1001;
    context.name = name;
    context.users = users;
    context.groups = groups;
    if (installed) {
        context.newuidmap = "/usr/bin/newuidmap";
        context.newgidmap = "/usr/bin/newgidmap";
    }
    return find_subordinate_range(context);
}

std::string refusal(std::string_view users, std::string_view groups)
{
    auto const found = find(users, groups);
    return found ? "" : found.error().message();
}

} // namespace

BOOST_AUTO_TEST_CASE(a_range_is_found_by_name_or_number)
{
    auto const found =
        find("ada:100000:65536\nwebots:165536:65536\n", "# no line\n1001:300000:70000").value();
    BOOST_TEST(found.first_user == 165536U);
    BOOST_TEST(found.first_group == 300000U);
    BOOST_TEST(found.count == 65536U);
    BOOST_TEST(found.newuidmap == "/usr/bin/newuidmap");
    BOOST_TEST(found.newgidmap == "/usr/bin/newgidmap");
}

BOOST_AUTO_TEST_CASE(of_several_ranges_the_first_that_is_large_enough_is_taken)
{
    auto const found =
        find("webots:100000:1000\nwebots:200000:131072\nwebots:400000:65536", "webots:200000:131072").value();
    BOOST_TEST(found.first_user == 200000U);
    BOOST_TEST(found.count == 131072U);
}

BOOST_AUTO_TEST_CASE(what_is_missing_is_said)
{
    BOOST_TEST(find("webots:100000:65536", "webots:100000:65536", "webots", false).error().message() ==
               "install newuidmap and newgidmap (Debian's package uidmap)");
    BOOST_TEST(refusal("", "") == "add the line \"webots:100000:65536\" to /etc/subuid and to /etc/subgid");
    BOOST_TEST(refusal("ada:100000:65536\n", "ada:100000:65536\n") ==
               "add the line \"webots:165536:65536\" to /etc/subuid and to /etc/subgid");
    BOOST_TEST(refusal("webots:100000:65536\n", "") == "add the line \"webots:165536:65536\" to /etc/subgid");
    BOOST_TEST(refusal("webots:100000:65535\n", "webots:100000:65536\n") ==
               "add the line \"webots:165536:65536\" to /etc/subuid");
    BOOST_TEST(find("webots:1:65536", "webots:1:65536", "").error().message() ==
               "the server's user, number 1001, has no name in /etc/passwd");
}

BOOST_AUTO_TEST_CASE(a_service_without_new_privileges_is_told_what_its_unit_is_missing)
{
    SubordinateContext context;
    context.name = "webots";
    context.users = context.groups = "webots:100000:65536";
    context.newuidmap = context.newgidmap = "/usr/bin/true";
    BOOST_TEST(find_subordinate_range(context).has_value());
    context.no_new_privs = true;
    BOOST_TEST(find_subordinate_range(context).error().message() ==
               "no_new_privs, as systemd's NoNewPrivileges= sets it, forbids newuidmap");
    context.pinned = "/run/webots/users";
    BOOST_TEST(find_subordinate_range(context).error().message().ends_with(
        ", and there is no /run/webots/users, which ExecStartPre= of our unit makes: take over that line, or "
        "see in the journal of the service why it has failed"));
}

BOOST_AUTO_TEST_CASE(lines_that_make_no_sense_are_passed_over)
{
    for (std::string_view const line :
         {"webots", "webots:", "webots:100000", "webots:x:65536", "webots:100000:65536:1", "webots:-1:65536",
          "webots:100000:99999999999999999999", "webots:4294967294:65536", "webots:4294960000:65536", "::"})
        BOOST_TEST(!refusal(line, line).empty());
}

BOOST_AUTO_TEST_SUITE_END()
