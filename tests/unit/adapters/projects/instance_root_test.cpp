// Only directories of this server are cleared at its start. Protocol section 6.5, quirk Q11.
#include "unit_test.hpp"

#include "adapters/projects/instance_root.hpp"

#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

using namespace webots_cloud;
using adapters::InstanceRoot;
namespace fs = std::filesystem;

namespace {

constexpr uid_t stranger = 65534;

struct InstanceRootFixture
{
    InstanceRootFixture() { fs::create_directories(instances); }
    ~InstanceRootFixture()
    {
        fs::remove_all(shared);
        ::umask(umask);
    }

    void put(fs::path const& file)
    {
        fs::create_directories(file.parent_path());
        std::ofstream(file) << "something";
    }

    /// What the operator reads when the start is refused.
    std::string refusal()
    {
        auto const root = InstanceRoot::open(user, "2000");
        BOOST_TEST_REQUIRE(!root.has_value());
        BOOST_TEST((root.error() == errc::invalid_argument));
        return root.error().message();
    }

    mode_t umask = ::umask(0022);
    fs::path shared = fs::canonical(fs::temp_directory_path()) /
                      ("webots_cloud_instance_root_" + std::to_string(::getpid()));
    fs::path user = shared / "webots-1000";
    fs::path port = user / "2000";
    fs::path instances = port / "instances";
};

bool says(std::string const& sentence, fs::path const& folder, std::string_view why)
{
    return sentence.find(folder.string() + ", for the directories of simulations: " + std::string(why)) !=
           std::string::npos;
}

mode_t mode_of(fs::path const& path)
{
    struct stat status;
    BOOST_REQUIRE(::stat(path.c_str(), &status) == 0);
    return status.st_mode & 07777;
}

} // namespace

BOOST_FIXTURE_TEST_SUITE(instance_root, InstanceRootFixture)

BOOST_AUTO_TEST_CASE(missing_folders_are_made_for_us_alone)
{
    fs::remove_all(user);
    auto const root = InstanceRoot::open(user, "2000");
    BOOST_TEST_REQUIRE(root.has_value());
    BOOST_TEST(root->left_overs().removed == 0u);
    for (auto const& folder : {user, port, instances})
        BOOST_TEST(mode_of(folder) == 0700u);
}

// As an overlay that a server left mounted when it was killed.
BOOST_AUTO_TEST_CASE(what_is_mounted_in_left_overs_is_unmounted_and_not_emptied)
{
    put(shared / "cache" / "file");
    auto const project = instances / "1" / "robots";
    fs::create_directories(project);
    if (::mount((shared / "cache").c_str(), project.c_str(), nullptr, MS_BIND, nullptr) != 0) {
        BOOST_TEST_MESSAGE("skipped: nothing may be mounted here");
        return;
    }
    auto const root = InstanceRoot::open(user, "2000");
    ::umount2(project.c_str(), MNT_DETACH);
    BOOST_TEST_REQUIRE(root.has_value());
    BOOST_TEST(root->left_overs().removed == 1u);
    BOOST_TEST(fs::is_empty(instances));
    BOOST_TEST(fs::exists(shared / "cache" / "file"));
}

BOOST_AUTO_TEST_CASE(left_overs_are_counted_and_go_and_what_is_beside_them_stays)
{
    put(instances / "1" / "robots" / "worlds" / "a.wbt");
    put(instances / "2" / "file");
    put(shared / "strangers" / "file");
    fs::create_directory_symlink(shared / "strangers", instances / "3");
    put(port / "other");
    put(user / "2001" / "instances" / "1" / "file");
    auto const root = InstanceRoot::open(user, "2000");
    BOOST_TEST_REQUIRE(root.has_value());
    BOOST_TEST(root->left_overs().removed == 3u);
    BOOST_TEST(fs::is_empty(instances));
    for (auto const& file :
         {port / "other", user / "2001" / "instances" / "1" / "file", shared / "strangers" / "file"})
        BOOST_TEST(fs::exists(file));
}

BOOST_AUTO_TEST_CASE(what_can_not_be_removed_is_set_aside_and_no_reason_not_to_start)
{
    if (::geteuid() != 0) {
        BOOST_TEST_MESSAGE("skipped: only root can make what others can't remove");
        return;
    }
    put(instances / "1" / "file");
    BOOST_REQUIRE(::chmod(shared.c_str(), 01777) == 0);
    for (auto const& folder : {user, port, instances})
        BOOST_REQUIRE(::chown(folder.c_str(), stranger, stranger) == 0);
    BOOST_REQUIRE(::seteuid(stranger) == 0);
    for (int start = 0; start < 2; ++start) {
        auto const root = InstanceRoot::open(user, "2000");
        BOOST_TEST_REQUIRE(root.has_value());
        BOOST_TEST(root->left_overs().removed == 0u);
        BOOST_TEST(root->left_overs().kept == 1u);
    }
    BOOST_REQUIRE(::seteuid(0) == 0);
    BOOST_TEST(!fs::exists(instances / "1"));
}

// A simulation, which runs as the same user, may do this.
BOOST_AUTO_TEST_CASE(what_is_in_the_place_of_a_folder_is_set_aside_and_not_followed)
{
    for (auto const& folder : {user, port, instances})
        for (bool const link : {true, false}) {
            BOOST_TEST_CONTEXT(folder << " " << link)
            {
                fs::remove_all(user);
                auto const target = shared / "strangers" / folder.filename();
                auto const victim = target / instances.lexically_relative(folder) / "project" / "file";
                put(victim);
                fs::create_directories(folder.parent_path());
                if (link)
                    fs::create_directory_symlink(target, folder);
                else
                    BOOST_REQUIRE(::mkfifo(folder.c_str(), 0600) == 0);
                auto const root = InstanceRoot::open(user, "2000");
                BOOST_TEST_REQUIRE(root.has_value());
                BOOST_TEST(root->path() == instances);
                BOOST_TEST_REQUIRE(root->notices().size() == 1u);
                BOOST_TEST(root->notices().front().find(folder.string() +
                                                        " was not what it has to be, and is now ") == 0u);
                BOOST_TEST(fs::is_directory(fs::symlink_status(instances)));
                BOOST_TEST(fs::exists(victim));
            }
        }
}

BOOST_AUTO_TEST_CASE(the_folder_that_the_operator_names_may_be_a_link)
{
    fs::remove_all(user);
    fs::create_directories(shared / "big_disk");
    fs::create_directory_symlink(shared / "big_disk", user);
    auto const root = InstanceRoot::open(user, "2000", InstanceRoot::State::may_be_link);
    BOOST_TEST_REQUIRE(root.has_value());
    BOOST_TEST(root->notices().empty());
    BOOST_TEST(fs::is_directory(shared / "big_disk" / "2000" / "instances"));
}

BOOST_AUTO_TEST_CASE(modes_that_let_others_in_or_us_not_are_mended)
{
    put(instances / "1" / "file");
    if (::geteuid() == 0) {
        BOOST_REQUIRE(::chmod(shared.c_str(), 01777) == 0);
        for (auto const& folder : {user, port, instances})
            BOOST_REQUIRE(::chown(folder.c_str(), stranger, stranger) == 0);
    }
    auto const before = ::geteuid();
    for (auto const link : {InstanceRoot::State::no_link, InstanceRoot::State::may_be_link})
        for (auto const& folder : {user, port, instances})
            for (auto const mode : {0777, 01777, 0770, 0, 0500}) {
                BOOST_TEST_CONTEXT(folder << " " << mode)
                {
                    BOOST_REQUIRE(::chmod(folder.c_str(), static_cast<mode_t>(mode)) == 0);
                    if (before == 0)
                        BOOST_REQUIRE(::seteuid(stranger) == 0);
                    auto const root = InstanceRoot::open(user, "2000", link);
                    BOOST_REQUIRE(::seteuid(before) == 0);
                    BOOST_TEST_REQUIRE(root.has_value());
                    BOOST_TEST(root->notices().size() == 1u);
                    BOOST_TEST((mode_of(folder) & 0722) == 0700u);
                }
            }
}

BOOST_AUTO_TEST_CASE(folders_of_another_user_are_not_used)
{
    if (::geteuid() != 0) {
        BOOST_TEST_MESSAGE("skipped: only root can give a folder away");
        return;
    }
    put(instances / "1" / "file");
    BOOST_REQUIRE(::chown(user.c_str(), stranger, stranger) == 0);
    BOOST_TEST(says(refusal(), user,
                    "it belongs to another user. Remove it, or set \"stateDir\" to another folder."));
    BOOST_TEST(fs::exists(instances / "1" / "file"));
    auto const chosen = InstanceRoot::open(user, "2000", InstanceRoot::State::may_be_link);
    BOOST_TEST_REQUIRE(!chosen.has_value());
    BOOST_TEST(says(chosen.error().message(), user,
                    "it belongs to another user. Give it to the user of this server"));
    BOOST_REQUIRE(::chown(user.c_str(), 0, 0) == 0);
    BOOST_REQUIRE(::chown(port.c_str(), stranger, stranger) == 0);
    auto const root = InstanceRoot::open(user, "2000");
    BOOST_TEST_REQUIRE(root.has_value());
    BOOST_TEST(root->notices().size() == 1u);
    BOOST_TEST(fs::is_empty(instances));
}

BOOST_AUTO_TEST_CASE(ours_may_be_in_a_folder_of_everybody_only_where_nobody_can_rename_them)
{
    BOOST_REQUIRE(::chmod(shared.c_str(), 0777) == 0);
    BOOST_TEST(
        says(refusal(), shared, "everybody may rename what is in it. Give it the sticky bit (chmod +t)"));
    BOOST_REQUIRE(::chmod(shared.c_str(), 01777) == 0);
    BOOST_TEST(InstanceRoot::open(user, "2000").has_value());
}

BOOST_AUTO_TEST_CASE(of_two_servers_the_second_is_refused_while_the_first_one_lives)
{
    {
        auto const first = InstanceRoot::open(user, "2000");
        BOOST_TEST_REQUIRE(first.has_value());
        put(instances / "1" / "file");
        auto const again = InstanceRoot::open(user, "2000");
        BOOST_TEST_REQUIRE(!again.has_value());
        BOOST_TEST(says(again.error().message(), instances,
                        "another simulation server uses it; is one running already?"));
        BOOST_TEST((again.error() != errc::invalid_argument)); // a later attempt may succeed
        BOOST_TEST(fs::exists(instances / "1" / "file"));
    }
    auto const second = InstanceRoot::open(user, "2000");
    BOOST_TEST_REQUIRE(second.has_value());
    BOOST_TEST(second->left_overs().removed == 1u);
}

BOOST_AUTO_TEST_CASE(folders_above_are_made)
{
    user = shared / "home" / ".local" / "state" / "webots_cloud";
    BOOST_TEST(InstanceRoot::open(user, "2000").has_value());
}

BOOST_AUTO_TEST_CASE(folders_that_can_not_be_made_say_why)
{
    user = "/proc/nowhere/webots-1000";
    auto const root = InstanceRoot::open(user, "2000");
    BOOST_TEST_REQUIRE(!root.has_value());
    BOOST_TEST(says(root.error().message(), "/proc/nowhere", "No such file or directory"));
}

BOOST_AUTO_TEST_SUITE_END()
