#include "unit_test.hpp"

#include "core/sandbox/firejail.hpp"
#include "core/text.hpp"

#include <algorithm>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(firejail)

namespace {

using Words = std::vector<std::string>;

FirejailMachine machine()
{
    FirejailMachine found;
    found.folders = {"/dev", "/etc", "/home", "/lib", "/proc", "/srv data", "/sys", "/tmp", "/usr", "/var"};
    found.files = {"/.dockerenv", "/bin"};
    found.name_servers = {"10.0.2.3"};
    return found;
}

bool has_line(std::string const& profile, std::string_view line)
{
    auto const lines = split(profile, '\n');
    return std::find(lines.begin(), lines.end(), line) != lines.end();
}

bool has(Words const& command, std::string_view word)
{
    return std::find(command.begin(), command.end(), word) != command.end();
}

Words command(Visible const& visible)
{
    return firejail_command("/usr/bin/firejail", "/state/p", visible, {"/opt/webots/webots", "--batch"});
}

Visible webots_and_a_project()
{
    Visible visible;
    visible.instance = "/state/instances/7";
    visible.directory = "/state/instances/7/worlds";
    visible.read_only = {"/opt/webots"};
    return visible;
}

} // namespace

BOOST_AUTO_TEST_CASE(folders_that_are_not_the_systems_are_hidden)
{
    auto const profile = firejail_profile(machine());
    for (auto const* folder : {"/home", "/srv data", "/tmp", "/var"})
        BOOST_TEST(has_line(profile, concat("whitelist ", folder, "/.nothing")), folder);
    for (auto const* folder : {"/dev", "/etc", "/lib", "/proc", "/sys", "/usr"})
        BOOST_TEST(!has_line(profile, concat("whitelist ", folder, "/.nothing")), folder);
    BOOST_TEST(has_line(profile, "blacklist /.dockerenv"));
    BOOST_TEST(!has_line(profile, "blacklist /bin"));
}

BOOST_AUTO_TEST_CASE(of_etc_it_sees_what_libraries_look_up)
{
    auto const profile = firejail_profile(machine());
    BOOST_TEST(has_line(profile, "whitelist /etc/passwd"));
    for (auto const* secret : {"/etc", "/etc/shadow", "/etc/ssl", "/etc/ssl/private"})
        BOOST_TEST(!has_line(profile, concat("whitelist ", secret)), secret);
}

BOOST_AUTO_TEST_CASE(it_has_no_capability_and_makes_no_namespaces)
{
    auto const profile = firejail_profile(machine());
    for (auto const* line : {"caps.drop all", "nonewprivs", "seccomp", "restrict-namespaces", "private-dev"})
        BOOST_TEST(has_line(profile, line), line);
    BOOST_TEST(profile.find("read-only /\n") < profile.find("read-write /tmp\n"));
}

BOOST_AUTO_TEST_CASE(it_ends_with_the_simulator_and_its_status)
{
    auto const profile = firejail_profile(machine());
    BOOST_TEST(has_line(profile, "deterministic-shutdown"));
    BOOST_TEST(has_line(profile, "deterministic-exit-code"));
}

BOOST_AUTO_TEST_CASE(what_the_kernel_says_of_devices_is_seen_with_graphics_processors_only)
{
    auto with = machine();
    with.has_graphics = true;
    BOOST_TEST(has_line(firejail_profile(machine()), "blacklist /sys"));
    BOOST_TEST(!has_line(firejail_profile(with), "blacklist /sys"));
}

BOOST_AUTO_TEST_CASE(names_are_asked_for_where_the_network_says)
{
    BOOST_TEST(has_line(firejail_profile(machine()), "dns 10.0.2.3"));
    BOOST_TEST((name_servers("# a comment\nnameserver 10.0.2.3\nsearch example.org\nnameserver\t::1 \n"
                             "nameservers 1.1.1.1\nnameserver\n") == Words{"10.0.2.3", "::1"}));
    BOOST_TEST(
        name_servers("nameserver 1.1.1.1\nnameserver 1.1.1.2\nnameserver 1.1.1.3\nnameserver 1.1.1.4\n")
            .size() == 3);
}

BOOST_AUTO_TEST_CASE(the_simulator_is_run_as_it_would_be_without)
{
    auto const words = command(webots_and_a_project());
    BOOST_TEST(words.front() == "/usr/bin/firejail");
    BOOST_TEST(has(words, "--profile=/state/p"));
    Words const end(words.end() - 3, words.end());
    BOOST_TEST((end == Words{"--", "/opt/webots/webots", "--batch"}));
}

BOOST_AUTO_TEST_CASE(it_writes_in_its_own_folder_alone)
{
    auto const words = command(webots_and_a_project());
    BOOST_TEST(has(words, "--whitelist=/state/instances/7"));
    BOOST_TEST(has(words, "--read-write=/state/instances/7"));
    BOOST_TEST(std::count_if(words.begin(), words.end(),
                             [](auto const& word) { return word.starts_with("--read-write"); }) == 1);
    BOOST_TEST(has(words, "--whitelist=/opt/webots"));
    BOOST_TEST(has(words, "--read-only=/opt/webots"));
}

BOOST_AUTO_TEST_CASE(nothing_of_the_system_is_shown_by_itself_since_that_would_hide_the_rest)
{
    auto visible = webots_and_a_project();
    visible.read_only = {"/usr/bin/webots-process-guard", "/usrlocal/webots"};
    auto const words = command(visible);
    BOOST_TEST(!has(words, "--whitelist=/usr/bin/webots-process-guard"));
    BOOST_TEST(has(words, "--whitelist=/usrlocal/webots"));
}

BOOST_AUTO_TEST_CASE(of_displays_it_sees_the_one_that_it_draws_on)
{
    auto visible = webots_and_a_project();
    visible.display = ":7";
    visible.x_authority = "/home/teacher/.Xauthority";
    auto const words = command(visible);
    BOOST_TEST(has(words, "--whitelist=/tmp/.X11-unix/X7"));
    BOOST_TEST(has(words, "--read-only=/home/teacher/.Xauthority"));
}

BOOST_AUTO_TEST_CASE(displays_of_its_own_have_their_sockets_where_all_look_for_them)
{
    auto visible = webots_and_a_project();
    BOOST_TEST(!has(command(visible), "--whitelist=/tmp/.X11-unix"));
    visible.own_displays = true;
    BOOST_TEST(has(command(visible), "--whitelist=/tmp/.X11-unix"));
    BOOST_TEST(has(command(visible), "--read-write=/tmp/.X11-unix"));
}

BOOST_AUTO_TEST_SUITE_END()
