#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>

#include <filesystem>
#include <fstream>

#include <sys/stat.h>
#include <unistd.h>

using namespace webots_cloud;

namespace fs = std::filesystem;

namespace {

/// A project and, beside it, what it must not lead to.
struct TextFilesFixture
{
    TextFilesFixture()
    {
        fs::create_directories(project / "worlds");
        fs::create_directories(outside);
        put(outside / "secret", "secret");
        put(project / "worlds" / "a.wbt", "world");
    }

    ~TextFilesFixture() { fs::remove_all(folder); }

    static void put(fs::path const& path, std::string const& text) { std::ofstream(path) << text; }

    static std::string get(fs::path const& path)
    {
        std::ifstream file(path);
        return {std::istreambuf_iterator<char>(file), {}};
    }

    template<class T>
    T run(boost::asio::awaitable<T> body)
    {
        auto outcome = boost::asio::co_spawn(context, std::move(body), boost::asio::use_future);
        context.restart();
        context.run();
        return outcome.get();
    }

    fs::path folder = fs::temp_directory_path() / ("webots_cloud_text_files_" + std::to_string(::getpid()));
    fs::path project = folder / "project";
    fs::path outside = folder / "outside";
    boost::asio::io_context context;
    std::unique_ptr<TextFiles> files = make_text_files();
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(text_files, TextFilesFixture)

BOOST_AUTO_TEST_CASE(texts_are_read_and_what_is_missing_is_nothing)
{
    auto const texts = run(files->read(project, {"worlds/a.wbt", "worlds/b.wbt", "worlds", "nowhere/a"}));
    BOOST_TEST_REQUIRE(texts.has_value());
    BOOST_TEST_REQUIRE(texts->size() == 4u);
    BOOST_TEST(texts->at(0).value_or("") == "world");
    for (auto const i : {1u, 2u, 3u})
        BOOST_TEST(!texts->at(i).has_value());
}

BOOST_AUTO_TEST_CASE(links_and_pipes_are_not_read)
{
    fs::create_symlink(outside / "secret", project / "webots.yml");
    fs::create_symlink(outside, project / "controllers");
    BOOST_TEST_REQUIRE(::mkfifo((project / "pipe").c_str(), 0600) == 0);
    auto const texts = run(files->read(project, {"webots.yml", "controllers/secret", "pipe"}));
    BOOST_TEST_REQUIRE(texts.has_value());
    for (auto const& text : *texts)
        BOOST_TEST(!text.has_value());
}

BOOST_AUTO_TEST_CASE(links_are_replaced_and_not_written_through)
{
    fs::create_symlink(outside / "secret", project / "Dockerfile");
    fs::create_symlink(outside, project / "controllers");
    std::vector<TextFile> const ours{TextFile("Dockerfile", "ours"), TextFile("worlds/a.wbt", "other")};
    BOOST_TEST(run(files->write(project, ours)).has_value());
    BOOST_TEST(get(project / "Dockerfile") == "ours");
    BOOST_TEST(get(project / "worlds" / "a.wbt") == "other");
    std::vector<TextFile> const through{TextFile("controllers/secret", "ours")};
    BOOST_TEST((run(files->write(project, through)).error() == errc::unavailable));
    BOOST_TEST(get(outside / "secret") == "secret");
}

BOOST_AUTO_TEST_CASE(what_may_be_run_stays_so)
{
    ::chmod((project / "worlds" / "a.wbt").c_str(), 0755);
    std::vector<TextFile> const ours{TextFile("worlds/a.wbt", "ours"), TextFile("worlds/b.wbt", "new")};
    BOOST_TEST(run(files->write(project, ours)).has_value());
    auto const may_be_run = [this](char const* name) {
        return (fs::status(project / "worlds" / name).permissions() & fs::perms::owner_exec) !=
               fs::perms::none;
    };
    BOOST_TEST(may_be_run("a.wbt"));
    BOOST_TEST(!may_be_run("b.wbt"));
}

BOOST_AUTO_TEST_CASE(all_files_of_a_folder_are_read_and_none_that_a_link_leads_to)
{
    auto const programs = project / "controllers";
    fs::create_directories(programs / "drive" / "lib");
    put(programs / "drive" / "drive.py", "go");
    put(programs / "drive" / "lib" / "map.py", "map");
    put(programs / "drive" / "large.bin", std::string(1'000, 'x'));
    put(programs / "drive" / ".hidden", "x");
    fs::create_symlink(outside, programs / "outside");
    fs::create_symlink(outside / "secret", programs / "drive" / "secret");
    BOOST_TEST_REQUIRE(::mkfifo((programs / "drive" / "pipe").c_str(), 0600) == 0);
    TextLimits limits;
    limits.bytes = 999;
    limits.files = 10;
    auto found = run(files->read_all(programs, limits));
    BOOST_TEST_REQUIRE(found.has_value());
    BOOST_TEST_REQUIRE(found->size() == 2u);
    BOOST_TEST(found->at(0).name == "drive/drive.py");
    BOOST_TEST(found->at(0).text == "go");
    BOOST_TEST(found->at(1).name == "drive/lib/map.py");
    limits.files = 1;
    BOOST_TEST(run(files->read_all(programs, limits))->size() == 1u);
    limits.files = 10;
    limits.depth = 1;
    BOOST_TEST(run(files->read_all(programs, limits))->size() == 1u);
    BOOST_TEST(run(files->read_all(project / "nothing", limits))->empty());
    fs::create_symlink(programs, project / "link");
    BOOST_TEST(run(files->read_all(project / "link", limits))->empty());
}

BOOST_AUTO_TEST_SUITE_END()
