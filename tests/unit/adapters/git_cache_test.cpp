// What tests/integration/git_source_test.py can't do from outside: damage at a certain moment.
#include "unit_test.hpp"

#include "adapters/git_cache.hpp"
#include "adapters/project_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <fstream>

using namespace webots_cloud;
using adapters::GitSnapshotPtr;
namespace fs = std::filesystem;

namespace {

constexpr auto url = "https://forge.org/owner/robots.git";

struct Fixture
{
    Fixture()
    {
        target.commit.bytes.fill(7);
        auto name = (fs::temp_directory_path() / "webots_cloud_cache_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        folder = name;
        cache.emplace(folder / "cache", 1'000'000);
        BOOST_TEST_REQUIRE(cache->usable().has_value());
    }

    ~Fixture()
    {
        cache.reset();
        fs::remove_all(folder);
    }

    /// A project of one file.
    GitSnapshotPtr publish()
    {
        auto const incoming = cache->begin();
        BOOST_TEST_REQUIRE(incoming.has_value());
        fs::create_directory(incoming->folder() / "files");
        std::ofstream(incoming->folder() / "files" / "a.wbt") << "world";
        adapters::GitIndexEntry file;
        file.kind = core::GitTreeEntry::Kind::file;
        file.path = "a.wbt";
        file.size = 5;
        adapters::GitIndex index;
        index.entries.push_back(file);
        index.bytes = 5;
        auto const published = cache->publish(*incoming, url, target, std::move(index));
        BOOST_TEST_REQUIRE(published.has_value());
        return *published;
    }

    fs::path folder;
    core::GitTarget target;
    std::optional<adapters::GitCache> cache;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(git_cache, Fixture)

BOOST_AUTO_TEST_CASE(a_damaged_folder_is_dropped_but_not_taken_from_who_uses_it)
{
    auto user = publish();
    auto const mounted = adapters::open_folder(AT_FDCWD, user->files.c_str());
    BOOST_TEST_REQUIRE(mounted.has_value());
    fs::resize_file(user->files / "a.wbt", 3);
    BOOST_TEST((cache->find(url, target) == nullptr));
    auto const again = publish();
    BOOST_TEST((cache->find(url, target) == again));
    BOOST_TEST(::faccessat(mounted->get(), "a.wbt", F_OK, 0) == 0);
    user.reset();
    cache->trim();
    BOOST_TEST(::faccessat(mounted->get(), "a.wbt", F_OK, 0) != 0);
    BOOST_TEST(fs::is_empty(folder / "cache" / "incoming"));
    BOOST_TEST((cache->find(url, target) == again));
}

BOOST_AUTO_TEST_CASE(a_cache_that_somebody_removes_is_made_anew_and_locked)
{
    publish();
    fs::remove_all(folder / "cache");
    BOOST_TEST((cache->find(url, target) == nullptr));
    auto const again = publish();
    BOOST_TEST((cache->find(url, target) == again));
    adapters::GitCache const other(folder / "cache", 1'000'000);
    BOOST_TEST(other.folder() == folder / "cache-1");
}

BOOST_AUTO_TEST_SUITE_END()
