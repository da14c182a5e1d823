#include "unit_test.hpp"

#include "core/sandbox/bubblewrap.hpp"

#include <algorithm>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(bubblewrap)

namespace {

using Words = std::vector<std::string>;

Visible webots_and_a_project()
{
    Visible visible;
    visible.instance = "/state/instances/7";
    visible.directory = "/state/instances/7/worlds";
    visible.read_only = {"/opt/webots"};
    return visible;
}

Words command(Visible const& visible)
{
    return bubblewrap_command("/usr/bin/bwrap", visible, {"/opt/webots/webots", "--batch"});
}

/// Where `words` begin in the command; its size: nowhere.
std::size_t position(Words const& command, Words const& words)
{
    return static_cast<std::size_t>(std::search(command.begin(), command.end(), words.begin(), words.end()) -
                                    command.begin());
}

bool has(Words const& command, Words const& words)
{
    return position(command, words) < command.size();
}

} // namespace

BOOST_AUTO_TEST_CASE(the_simulator_is_run_as_it_would_be_without)
{
    auto const words = command(webots_and_a_project());
    BOOST_TEST(words.front() == "/usr/bin/bwrap");
    Words const end(words.end() - 3, words.end());
    BOOST_TEST((end == Words{"--", "/opt/webots/webots", "--batch"}));
    BOOST_TEST(has(words, {"--chdir", "/state/instances/7/worlds"}));
}

BOOST_AUTO_TEST_CASE(it_writes_in_its_own_folder_alone)
{
    auto const words = command(webots_and_a_project());
    BOOST_TEST(std::count(words.begin(), words.end(), "--bind") == 1);
    BOOST_TEST(has(words, {"--bind", "/state/instances/7", "/state/instances/7"}));
    BOOST_TEST(has(words, {"--ro-bind-try", "/opt/webots", "/opt/webots"}));
    BOOST_TEST(has(words, {"--remount-ro", "/"}));
}

BOOST_AUTO_TEST_CASE(a_folder_below_the_temporary_one_is_shown_after_that_was_made)
{
    auto visible = webots_and_a_project();
    visible.instance = "/tmp/state/7";
    auto const words = command(visible);
    BOOST_TEST(position(words, {"--tmpfs", "/tmp"}) < position(words, {"--bind", "/tmp/state/7"}));
}

BOOST_AUTO_TEST_CASE(nothing_of_etc_is_shown_that_could_be_a_secret)
{
    auto const words = command(webots_and_a_project());
    for (auto const* secret : {"/etc", "/etc/shadow", "/etc/ssl", "/etc/ssl/private", "/etc/webots-cloud",
                               "/home", "/root", "/var", "/run", "/sys", "/"})
        BOOST_TEST(!has(words, {"--ro-bind-try", secret}), secret);
}

BOOST_AUTO_TEST_CASE(links_of_the_system_are_links_and_small_files_are_copied)
{
    auto visible = webots_and_a_project();
    auto const mounted = command(visible);
    BOOST_TEST(has(mounted, {"--ro-bind-try", "/bin", "/bin"}));
    BOOST_TEST(has(mounted, {"--ro-bind-try", "/etc/passwd", "/etc/passwd"}));
    visible.system_links = {{"/bin", "usr/bin"}};
    visible.copied = {"/etc/passwd", "/etc/hosts"};
    visible.first_copied = 10;
    auto const words = command(visible);
    BOOST_TEST(has(words, {"--symlink", "usr/bin", "/bin"}));
    BOOST_TEST(has(words, {"--perms", "0444", "--file", "10", "/etc/passwd"}));
    BOOST_TEST(has(words, {"--perms", "0444", "--file", "11", "/etc/hosts"}));
    for (auto const* path : {"/bin", "/etc/passwd", "/etc/hosts"})
        BOOST_TEST(!has(words, {"--ro-bind-try", path}), path);
    BOOST_TEST(has(words, {"--ro-bind-try", "/lib", "/lib"}));
    BOOST_TEST(has(words, {"--ro-bind-try", "/etc/fonts", "/etc/fonts"}));
}

BOOST_AUTO_TEST_CASE(what_is_seen_with_a_folder_above_is_not_shown_again)
{
    auto visible = webots_and_a_project();
    visible.read_only = {"/opt/webots", "/opt/webots/bin/guard", "/usr/lib/guard", "/opt/webots2"};
    auto const words = command(visible);
    BOOST_TEST(has(words, {"--ro-bind-try", "/opt/webots", "/opt/webots"}));
    BOOST_TEST(has(words, {"--ro-bind-try", "/opt/webots2"}));
    BOOST_TEST(!has(words, {"--ro-bind-try", "/opt/webots/bin/guard"}));
    BOOST_TEST(!has(words, {"--ro-bind-try", "/usr/lib/guard"}));
}

BOOST_AUTO_TEST_CASE(it_has_its_own_processes_and_no_capability)
{
    auto const words = command(webots_and_a_project());
    for (auto const* option : {"--unshare-user", "--disable-userns", "--unshare-pid", "--unshare-ipc",
                               "--die-with-parent", "--new-session"})
        BOOST_TEST(has(words, {option}), option);
    BOOST_TEST(has(words, {"--cap-drop", "ALL"}));
}

BOOST_AUTO_TEST_CASE(settings_of_the_kernel_are_covered_after_proc_was_mounted)
{
    auto const words = command(webots_and_a_project());
    BOOST_TEST(has(words, {"--ro-bind-try", "/proc/sys", "/proc/sys"}));
    BOOST_TEST(position(words, {"--proc", "/proc"}) < position(words, {"--ro-bind-try", "/proc/sys"}));
}

BOOST_AUTO_TEST_CASE(of_displays_it_sees_the_one_that_it_draws_on)
{
    auto visible = webots_and_a_project();
    for (auto const* display : {":7", ":7.0"}) {
        visible.display = display;
        BOOST_TEST(has(command(visible), {"--ro-bind-try", "/tmp/.X11-unix/X7"}), display);
    }
    for (auto const* display : {"", "host:0", ":", ":7/../../etc", ":x"}) {
        visible.display = display;
        auto const words = command(visible);
        BOOST_TEST(std::none_of(words.begin(), words.end(),
                                [](auto const& word) { return word.find("X11") != std::string::npos; }),
                   display);
    }
}

BOOST_AUTO_TEST_CASE(with_a_display_of_its_own_it_sees_a_folder_of_displays_of_its_own)
{
    auto visible = webots_and_a_project();
    visible.own_displays = true;
    auto const words = command(visible);
    BOOST_TEST(has(words, {"--perms", "1777", "--size", "65536", "--tmpfs", "/tmp/.X11-unix"}));
    BOOST_TEST(position(words, {"--tmpfs", "/tmp"}) < position(words, {"--tmpfs", "/tmp/.X11-unix"}));
}

BOOST_AUTO_TEST_CASE(what_graphics_processors_say_of_themselves_is_seen_with_them_only)
{
    auto visible = webots_and_a_project();
    BOOST_TEST(!has(command(visible), {"/sys/devices"}));
    visible.devices = {"/dev/dri"};
    BOOST_TEST(has(command(visible), {"/sys/devices"}));
    BOOST_TEST(has(command(visible), {"--dev-bind-try", "/dev/dri", "/dev/dri"}));
}

BOOST_AUTO_TEST_CASE(memory_for_files_is_bounded_everywhere)
{
    auto visible = webots_and_a_project();
    visible.temporary_bytes = 12345;
    auto const words = command(visible);
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i] == "--tmpfs")
            BOOST_TEST(words[i - 2] == "--size", words[i + 1]);
    }
    BOOST_TEST(has(words, {"--size", "12345", "--tmpfs", "/tmp"}));
    BOOST_TEST(has(words, {"--remount-ro", "/dev"}));
}

BOOST_AUTO_TEST_SUITE_END()
