// Damage at chosen moments, which tests/integration/git_source_test.py can't do from outside.
#include "unit_test.hpp"

#include "adapters/files/project_files.hpp"
#include "adapters/git_cache/git_cache.hpp"
#include "adapters/git_cache/git_proof.hpp"
#include "adapters/git_packs/git_digest.hpp"

#include <webots_cloud/load_report.hpp>

#include <fcntl.h>
#include <unistd.h>

#include <fstream>

using namespace webots_cloud;
using adapters::GitSnapshotPtr;
namespace fs = std::filesystem;

namespace {

constexpr auto url = "https://forge.org/owner/robots.git";

GitSourceConfig small_cache()
{
    GitSourceConfig config;
    config.cache_bytes = 1'000'000;
    return config;
}

struct GitCacheFixture
{
    GitCacheFixture()
    {
        auto name = (fs::temp_directory_path() / "webots_cloud_cache_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        folder = name;
        cache.emplace(folder / "cache", small_cache());
        BOOST_TEST_REQUIRE(cache->usable().has_value());
    }

    ~GitCacheFixture()
    {
        cache.reset();
        fs::remove_all(folder);
    }

    static core::GitObjectId id_of(std::string const& kind, std::string const& object)
    {
        adapters::GitDigest digest;
        digest.update(kind + " " + std::to_string(object.size()) + std::string(1, '\0') + object);
        return digest.finish();
    }

    /// Makes the target a commit of the folder that has this file alone.
    std::string prove(core::GitObjectId const& file)
    {
        auto const tree = std::string("100644 a.wbt") + '\0' +
                          std::string(reinterpret_cast<char const*>(file.bytes.data()), file.bytes.size());
        auto const commit = "tree " + to_hex(id_of("tree", tree)) + "\nauthor A <a> 1 +0000\n\nmessage\n";
        target.commit = id_of("commit", commit);
        adapters::GitProof proof("");
        proof.add_commit(commit);
        proof.add_tree(id_of("tree", tree), tree);
        return proof.text();
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
        adapters::GitDigest digest;
        digest.update(std::string_view("blob 5\0world", 12));
        file.id = digest.finish();
        adapters::GitIndex index;
        index.entries.push_back(file);
        index.bytes = 5;
        auto const proof = prove(file.id);
        auto const published = cache->publish(*incoming, url, target, std::move(index), proof);
        BOOST_TEST_REQUIRE(published.has_value());
        return *published;
    }

    /// As a server does that is restarted.
    void reopen()
    {
        cache.reset();
        cache.emplace(folder / "cache", small_cache());
    }

    fs::path folder;
    core::GitTarget target;
    std::optional<adapters::GitCache> cache;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(git_cache, GitCacheFixture)

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
    adapters::GitCache const other(folder / "cache", small_cache());
    BOOST_TEST(other.folder() == folder / "cache-1");
}

// A simulation runs as the same user, and may write anything into the cache.
BOOST_AUTO_TEST_CASE(content_of_the_same_size_is_noticed_and_said)
{
    for (bool const again : {false, true}) {
        auto const file = publish()->files / "a.wbt";
        BOOST_TEST((cache->find(url, target) != nullptr));
        auto const written = fs::last_write_time(file);
        std::ofstream(file) << "evil!";
        fs::last_write_time(file, written);
        if (again)
            reopen();
        BOOST_TEST((cache->find(url, target) == nullptr));
        auto const notices = cache->take_notices();
        BOOST_TEST_REQUIRE(notices.size() == 1u);
        BOOST_TEST(notices.front().find(std::string(url) + " was changed") != std::string::npos);
    }
}

BOOST_AUTO_TEST_CASE(files_that_were_added_and_rights_that_were_given_are_noticed)
{
    auto const files = publish()->files;
    std::ofstream(files / "b.wbt") << "evil";
    BOOST_TEST((cache->find(url, target) == nullptr));
    auto const again = publish()->files;
    fs::permissions(again / "a.wbt", fs::perms::owner_exec, fs::perm_options::add);
    BOOST_TEST((cache->find(url, target) == nullptr));
}

BOOST_AUTO_TEST_CASE(an_index_that_was_changed_with_its_files_is_noticed)
{
    for (bool const again : {false, true}) {
        auto const files = publish()->files;
        std::ofstream(files / "a.wbt") << "evil!";
        adapters::GitIndexEntry file;
        file.kind = core::GitTreeEntry::Kind::file;
        file.path = "a.wbt";
        file.size = 5;
        adapters::GitDigest digest;
        digest.update(std::string_view("blob 5\0evil!", 12));
        file.id = digest.finish();
        adapters::GitIndex index;
        index.entries.push_back(file);
        std::ofstream(files.parent_path() / "index") << adapters::write_index(index);
        if (again)
            reopen();
        BOOST_TEST((cache->find(url, target) == nullptr));
    }
}

BOOST_AUTO_TEST_CASE(what_is_as_it_was_is_used_by_the_next_server)
{
    publish();
    reopen();
    BOOST_TEST((cache->find(url, target) != nullptr));
    reopen();
    BOOST_TEST(cache->relatives(url).size() == 1u);
    BOOST_TEST(cache->take_notices().empty());
}

// All users of a folder share one object, including those that search for donors.
BOOST_AUTO_TEST_CASE(a_folder_says_what_it_is_whoever_opened_it_first)
{
    publish();
    for (bool const again : {false, true}) {
        if (again)
            reopen();
        auto const relatives = cache->relatives(url);
        BOOST_TEST_REQUIRE(relatives.size() == 1u);
        BOOST_TEST((relatives.front()->target == target));
        auto const found = cache->find(url, target);
        BOOST_TEST((found == relatives.front()));
    }
}

// Optional files are left out all together, so if only one is missing, it was removed.
BOOST_AUTO_TEST_CASE(some_files_of_the_folders_above_are_no_proven_folder)
{
    auto const entry = [](std::string const& mode, std::string const& name, core::GitObjectId const& id) {
        return mode + " " + name + '\0' +
               std::string(reinterpret_cast<char const*>(id.bytes.data()), id.bytes.size());
    };
    auto const file = id_of("blob", "x");
    auto const inner = entry("100644", "a.wbt", file);
    auto const outer = entry("100644", "a", file) + entry("100644", "b", file) +
                       entry("120000", "link", file) + entry("40000", "p", id_of("tree", inner));
    auto const commit = "tree " + to_hex(id_of("tree", outer)) + "\nauthor A <a> 1 +0000\n\nmessage\n";
    adapters::GitProof proof("p");
    proof.add_commit(commit);
    proof.add_tree(id_of("tree", outer), outer);
    proof.add_tree(id_of("tree", inner), inner);
    auto const proven = [&](std::vector<std::string> const& paths) {
        using Kind = core::GitTreeEntry::Kind;
        adapters::GitIndex index;
        for (auto const& path : paths) {
            adapters::GitIndexEntry item;
            item.kind = path == "p" ? Kind::folder : path == "link" ? Kind::link : Kind::file;
            item.path = path;
            item.id = path == "p" ? id_of("tree", inner) : file;
            index.entries.push_back(item);
        }
        return adapters::is_proven(proof.text(), id_of("commit", commit), index);
    };
    BOOST_TEST(proven({"a", "b", "link", "p", "p/a.wbt"}));
    BOOST_TEST(proven({"a", "b", "p", "p/a.wbt"})); // the link leads out of the folder
    BOOST_TEST(proven({"p", "p/a.wbt"}));
    BOOST_TEST(!proven({"a", "p", "p/a.wbt"}));
    BOOST_TEST(!proven({"b", "link", "p", "p/a.wbt"}));
    BOOST_TEST(!proven({"a", "b", "link", "p"}));
    BOOST_TEST(!proven({"a", "b", "c", "link", "p", "p/a.wbt"}));
}

BOOST_AUTO_TEST_CASE(what_a_link_in_the_cache_leads_to_is_not_cleared_away)
{
    publish();
    auto const victim = folder / "victim";
    fs::create_directories(victim / "project");
    std::ofstream(victim / "project" / "file") << "precious";
    fs::create_directory_symlink(victim, folder / "cache" / "repositories" / "evil");
    reopen();
    BOOST_TEST(fs::exists(victim / "project" / "file"));
    BOOST_TEST(!fs::exists(fs::symlink_status(folder / "cache" / "repositories" / "evil")));
    BOOST_TEST((cache->find(url, target) != nullptr));
}

BOOST_AUTO_TEST_CASE(what_is_in_the_place_of_its_folders_is_set_aside)
{
    auto const victim = folder / "victim";
    fs::create_directories(victim);
    std::ofstream(victim / "file") << "precious";
    for (auto const& place :
         {folder / "cache", folder / "cache" / "repositories", folder / "cache" / "incoming"}) {
        BOOST_TEST_CONTEXT(place)
        {
            cache.reset();
            fs::remove_all(place);
            fs::create_directory_symlink(victim, place);
            cache.emplace(folder / "cache", small_cache());
            BOOST_TEST_REQUIRE(cache->usable().has_value());
            BOOST_TEST(cache->take_notices().front().find(place.string() + " was not what it has to be") ==
                       0u);
            BOOST_TEST(fs::exists(victim / "file"));
            publish();
            BOOST_TEST((cache->find(url, target) != nullptr));
        }
    }
}

BOOST_AUTO_TEST_CASE(the_projects_that_are_there_are_listed_at_the_start)
{
    BOOST_TEST(cache->projects_at_start().empty());
    publish();
    cache->remember(url, "main/folder", target);
    auto elsewhere = target;
    elsewhere.folder = "not here";
    cache->remember(url, "dev", elsewhere);
    BOOST_TEST((cache->recall(url, "main/folder").value().commit == target.commit));
    BOOST_TEST(cache->recall(url, "dev").value().folder == "not here");
    reopen();
    std::vector<std::uint32_t> const expected = {
        project_key("https://forge.org/owner/robots", "main/folder")};
    BOOST_TEST((cache->projects_at_start() == expected));
    BOOST_TEST((adapters::project_key_of(url, "main/folder") == expected.front()));
    // Half of what was written.
    for (auto const& ref : fs::recursive_directory_iterator(folder / "cache" / "repositories"))
        if (ref.path().parent_path().filename() == "refs")
            std::ofstream(ref.path()) << to_hex(target.commit) << " folder\n";
    reopen();
    BOOST_TEST(!cache->recall(url, "main/folder"));
    BOOST_TEST(cache->projects_at_start().empty());
    cache->make_room();
    reopen();
    BOOST_TEST(cache->projects_at_start().empty());
}

BOOST_AUTO_TEST_SUITE_END()
