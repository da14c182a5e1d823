#include "unit_test.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "adapters/files/remove_tree.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

using namespace webots_cloud;
namespace fs = std::filesystem;

namespace {

constexpr uid_t nobody = 65534;

/// An empty folder of an unprivileged user, as whom the test runs until its end.
struct RemoveTreeSuiteFixture
{
    RemoveTreeSuiteFixture()
    {
        auto name = (fs::temp_directory_path() / "webots_cloud_remove_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        folder = name;
        if (user == 0) {
            BOOST_TEST_REQUIRE(::chown(name.c_str(), nobody, static_cast<gid_t>(-1)) == 0);
            BOOST_TEST_REQUIRE(::seteuid(nobody) == 0);
        }
        fs::create_directories(folder / "project" / "locked" / "inner");
        std::ofstream(folder / "project" / "locked" / "inner" / "file") << "x";
    }

    ~RemoveTreeSuiteFixture()
    {
        BOOST_TEST(::seteuid(user) == 0);
        fs::remove_all(folder);
    }

    uid_t user = ::geteuid();
    fs::path folder;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(remove_tree_suite, RemoveTreeSuiteFixture)

BOOST_AUTO_TEST_CASE(folders_that_their_owner_may_not_enter_or_change_are_removed_too)
{
    fs::create_directory(folder / "project" / "fixed");
    std::ofstream(folder / "project" / "fixed" / "file") << "x";
    fs::permissions(folder / "project" / "fixed", fs::perms::owner_read | fs::perms::owner_exec);
    fs::permissions(folder / "project" / "locked" / "inner", fs::perms::none);
    fs::permissions(folder / "project" / "locked", fs::perms::none);
    BOOST_TEST(adapters::remove_tree(folder / "project").has_value());
    BOOST_TEST(!fs::exists(folder / "project"));
}

BOOST_AUTO_TEST_CASE(what_links_lead_to_is_left_as_it_is)
{
    fs::create_directory(folder / "other");
    fs::permissions(folder / "other", fs::perms::owner_read);
    fs::create_directory_symlink(folder / "other", folder / "project" / "link");
    fs::permissions(folder / "project" / "locked", fs::perms::none);
    BOOST_TEST(adapters::remove_tree(folder / "project").has_value());
    BOOST_TEST((fs::status(folder / "other").permissions() == fs::perms::owner_read));
}

/// Folders inside one another, deeper than a path may be long; returns the innermost.
adapters::FileDescriptor dig(fs::path const& folder, int levels)
{
    adapters::FileDescriptor inner(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    for (int level = 0; level < levels; ++level) {
        BOOST_TEST_REQUIRE(::mkdirat(inner.get(), "a_folder_of_a_name", 0700) == 0);
        inner = adapters::FileDescriptor(
            ::openat(inner.get(), "a_folder_of_a_name", O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    }
    return inner;
}

BOOST_AUTO_TEST_CASE(no_depth_is_too_deep_whatever_it_ends_in)
{
    auto const deepest = dig(folder / "project", 3000);
    BOOST_TEST_REQUIRE(::mkdirat(deepest.get(), "locked", 0000) == 0);
    BOOST_TEST_REQUIRE(::mkdirat(deepest.get(), "other", 0700) == 0);
    BOOST_TEST_REQUIRE(::symlinkat("/", deepest.get(), "link") == 0);
    BOOST_TEST_REQUIRE(::fchmod(deepest.get(), 0500) == 0);
    rlimit before{};
    ::getrlimit(RLIMIT_NOFILE, &before);
    rlimit const few{200, before.rlim_max};
    ::setrlimit(RLIMIT_NOFILE, &few);
    BOOST_TEST(adapters::remove_tree(folder / "project").has_value());
    ::setrlimit(RLIMIT_NOFILE, &before);
    BOOST_TEST(!fs::exists(folder / "project"));
}

BOOST_AUTO_TEST_CASE(nothing_there_is_fine)
{
    BOOST_TEST(adapters::remove_tree(folder / "nothing").has_value());
}

BOOST_AUTO_TEST_SUITE_END()
