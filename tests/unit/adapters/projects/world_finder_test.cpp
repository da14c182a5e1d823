#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/testing/recording_log.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>

#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(world_finder)

namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;

struct WorldFolder : ScratchFolder
{
    void write(fs::path const& file, std::string_view text = "#VRML_SIM R2025a utf8\n") const
    {
        fs::create_directories((folder / file).parent_path());
        std::ofstream(folder / file) << text;
    }

    std::vector<FoundWorld> find() const
    {
        std::vector<ForgeConfig> forges{ForgeConfig("https://github.com"), ForgeConfig("local:")};
        forges.back().directory = folder;
        auto const finder = make_world_finder(forges, log.logger());
        std::vector<FoundWorld> found;
        for (int looks = 0; looks < 2; ++looks) {
            asio::io_context context;
            auto finding = asio::co_spawn(context, finder->find(), asio::use_future);
            context.run();
            found = finding.get();
        }
        return found;
    }

    mutable testing::RecordingLog log;

    std::vector<std::string> addresses() const
    {
        std::vector<std::string> all;
        for (auto const& found : find())
            all.push_back(found.world.url);
        return all;
    }
};

using FoundAddresses = std::vector<std::string>;

} // namespace

BOOST_FIXTURE_TEST_CASE(worlds_are_found_with_their_addresses_and_what_they_say, WorldFolder)
{
    write("o/r/worlds/b.wbt", "WorldInfo { title \"The second\" info [ \"About it.\" ] }");
    write("o/r/worlds/a 1.wbt");
    write("o/q/projects/arm/worlds/arm.wbt");
    auto const found = find();
    BOOST_TEST_REQUIRE(found.size() == 3u);
    BOOST_TEST(found[0].world.url == "local:/o/q/blob/main/projects/arm/worlds/arm.wbt");
    BOOST_TEST(found[1].world.url == "local:/o/r/blob/main/worlds/a%201.wbt");
    BOOST_TEST(found[1].world.title.empty());
    BOOST_TEST(found[2].world.url == "local:/o/r/blob/main/worlds/b.wbt");
    BOOST_TEST(found[2].world.title == "The second");
    BOOST_TEST(found[2].world.text == "About it.");
    BOOST_TEST(found[2].forge == "local:");
}

BOOST_FIXTURE_TEST_CASE(a_lesson_has_titles_in_languages, WorldFolder)
{
    auto const text = R"({"title":{"en":"Move","de":"Fahren"},"about":{"de":"Zum Ziel."}})";
    for (auto const* name : {"good", "linked", "wrong"})
        write(fs::path("o/r/worlds") / (std::string(name) + ".wbt"));
    write("o/r/worlds/good.lesson.json", text);
    write("o/r/worlds/wrong.lesson.json", "{");
    write("elsewhere.json", text);
    fs::create_symlink(folder / "elsewhere.json", folder / "o/r/worlds/linked.lesson.json");
    auto const found = find();
    BOOST_TEST_REQUIRE(found.size() == 3u);
    BOOST_TEST((found[0].world.titles == TextInLanguages{{"de", "Fahren"}, {"en", "Move"}}));
    BOOST_TEST((found[0].world.texts == TextInLanguages{{"de", "Zum Ziel."}}));
    BOOST_TEST(found[1].world.titles.empty());
    BOOST_TEST(found[2].world.titles.empty());
}

BOOST_FIXTURE_TEST_CASE(what_is_found_can_be_fetched, WorldFolder)
{
    write("o/r/projects/two arms/worlds/ä.wbt");
    auto const all = addresses();
    BOOST_TEST_REQUIRE(all.size() == 1u);
    auto const parsed = parse_world_url(all[0], {ForgeAddress("local:")});
    BOOST_TEST_REQUIRE(parsed.has_value());
    BOOST_TEST(parsed->ref_and_folder == "main/projects/two arms");
    BOOST_TEST(parsed->world == "ä.wbt");
}

BOOST_FIXTURE_TEST_CASE(projects_that_are_not_published_are_left_out, WorldFolder)
{
    write("o/r/worlds/a.wbt");
    write("o/r/webots.yml", "publish: false\n");
    write("o/r/inner/worlds/b.wbt");
    BOOST_TEST(addresses() == FoundAddresses{"local:/o/r/blob/main/inner/worlds/b.wbt"},
               boost::test_tools::per_element());
}

BOOST_FIXTURE_TEST_CASE(other_files_and_hidden_ones_are_left_out, WorldFolder)
{
    write("o/r/worlds/.a.wbt");
    write("o/r/worlds/a.wbproj");
    write("o/r/worlds/empty.wbt", "");
    write("o/r/.git/worlds/a.wbt");
    write("o/worlds/a.wbt");
    write("o/r/1/2/3/4/worlds/deep.wbt");
    fs::create_directories(folder / "o/r/worlds/folder.wbt");
    BOOST_TEST(::mkfifo((folder / "o/r/worlds/pipe.wbt").c_str(), 0600) == 0);
    BOOST_TEST(addresses() == FoundAddresses(), boost::test_tools::per_element());
}

BOOST_FIXTURE_TEST_CASE(links_of_the_operator_are_followed_and_those_in_projects_not, WorldFolder)
{
    write("elsewhere/worlds/a.wbt");
    fs::create_directories(folder / "o/own/worlds");
    fs::create_directory_symlink(folder / "elsewhere", folder / "o/linked");
    fs::create_directory_symlink(folder / "elsewhere", folder / "o/own/inner");
    fs::create_symlink(folder / "elsewhere/worlds/a.wbt", folder / "o/own/worlds/a.wbt");
    BOOST_TEST(addresses() == FoundAddresses{"local:/o/linked/blob/main/worlds/a.wbt"},
               boost::test_tools::per_element());
}

BOOST_FIXTURE_TEST_CASE(what_no_address_can_name_is_left_out_and_told_once, WorldFolder)
{
    write("o/my class/worlds/a.wbt");
    write("o/my class/worlds/b.wbt");
    write("o/r/worlds/a world.wbt");
    BOOST_TEST(addresses() == FoundAddresses{"local:/o/r/blob/main/worlds/a%20world.wbt"},
               boost::test_tools::per_element());
    BOOST_TEST_REQUIRE(log.lines.size() == 1u);
    BOOST_TEST(
        log.contains("my class are not listed: Wrong Webots simulation URL: \"my class\" is no name of a "
                     "repository. Rename the folder."));
}

BOOST_FIXTURE_TEST_CASE(a_folder_that_is_not_there_has_no_worlds, WorldFolder)
{
    fs::remove_all(folder);
    BOOST_TEST(find().empty());
}

BOOST_FIXTURE_TEST_CASE(of_very_many_worlds_some_are_found, WorldFolder)
{
    for (int i = 0; i < 250; ++i)
        write("o/r/worlds/" + std::to_string(i) + ".wbt");
    BOOST_TEST(find().size() == 200u);
}

BOOST_AUTO_TEST_SUITE_END()
