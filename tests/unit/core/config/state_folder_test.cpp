#include "unit_test.hpp"

#include "core/config/state_folder.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(state_folder)

namespace {

using Folders = std::vector<StateFolder>;

StateFolderContext everything()
{
    StateFolderContext all;
    all.configured = "/srv/webots";
    all.state_directory = "/var/lib/a:/var/lib/b";
    all.xdg_state_home = "/home/w/state";
    all.home = "/home/w";
    all.temporary = "/tmp";
    all.user = 1000;
    return all;
}

} // namespace

BOOST_AUTO_TEST_CASE(what_the_operator_or_systemd_names_is_the_only_one)
{
    auto all = everything();
    BOOST_TEST((state_folders(all) == Folders{StateFolder("/srv/webots", true)}));
    all.configured.clear();
    BOOST_TEST((state_folders(all) == Folders{StateFolder("/var/lib/a", true)}));
}

BOOST_AUTO_TEST_CASE(otherwise_it_is_in_the_home_folder_or_among_the_temporary_files)
{
    auto all = everything();
    all.configured.clear();
    all.state_directory = "relative";
    StateFolder const last("/tmp/webots-1000", false);
    BOOST_TEST((state_folders(all) == Folders{StateFolder("/home/w/state/webots_cloud", false), last}));
    all.xdg_state_home = "relative";
    BOOST_TEST(
        (state_folders(all) == Folders{StateFolder("/home/w/.local/state/webots_cloud", false), last}));
    all.home.clear();
    BOOST_TEST((state_folders(all) == Folders{last}));
}

BOOST_AUTO_TEST_CASE(what_is_fetched_is_in_the_home_folder_or_beside_the_working_files)
{
    auto all = everything();
    all.xdg_cache_home = "/home/w/cache";
    BOOST_TEST(cache_folder(all, "/tmp/webots-1000") == "/home/w/cache/webots_cloud");
    all.xdg_cache_home = "relative";
    BOOST_TEST(cache_folder(all, "/tmp/webots-1000") == "/home/w/.cache/webots_cloud");
    all.home = "relative";
    BOOST_TEST(cache_folder(all, "/tmp/webots-1000") == "/tmp/webots-1000/cache");
}

BOOST_AUTO_TEST_SUITE_END()
