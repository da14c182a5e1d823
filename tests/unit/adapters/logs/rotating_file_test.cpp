#include "unit_test.hpp"

#include "adapters/logs/rotating_file.hpp"

#include <spdlog/pattern_formatter.h>

#include <sys/stat.h>

#include <cstdlib>
#include <fstream>
#include <set>
#include <sstream>

using webots_cloud::adapters::RotatingFile;
namespace fs = std::filesystem;

// Protocol section 9.1.
BOOST_AUTO_TEST_SUITE(rotating_file)

namespace {

/// A folder that is removed at the end of the test.
struct Folder
{
    Folder()
    {
        std::string name = (fs::temp_directory_path() / "webots_cloud_log_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        path = name;
    }
    ~Folder() { fs::remove_all(path); }

    std::string read(std::string const& name) const
    {
        std::ostringstream text;
        text << std::ifstream(path / name).rdbuf();
        return text.str();
    }

    std::set<std::string> names() const
    {
        std::set<std::string> names;
        for (auto const& entry : fs::directory_iterator(path))
            names.insert(entry.path().filename().string());
        return names;
    }

    fs::path path;
};

void write(RotatingFile& file, std::string const& line)
{
    file.log(spdlog::details::log_msg("", spdlog::level::info, line));
    file.flush();
}

std::unique_ptr<RotatingFile> open(Folder const& folder)
{
    auto file = std::make_unique<RotatingFile>(folder.path / "output.log", 10, 2);
    file->set_formatter(std::make_unique<spdlog::pattern_formatter>("%v"));
    return file;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_full_file_gets_a_number_and_only_so_many_are_kept)
{
    Folder folder;
    auto const file = open(folder);
    for (auto const* line : {"1111", "2222", "3333", "4444", "5555", "6666", "7777"}) // two lines fill a file
        write(*file, line);
    BOOST_TEST((folder.names() == std::set<std::string>{"output.log", "output.log.1", "output.log.2"}));
    BOOST_TEST(folder.read("output.log") == "7777\n");
    BOOST_TEST(folder.read("output.log.1") == "5555\n6666\n");
    BOOST_TEST(folder.read("output.log.2") == "3333\n4444\n");
}

BOOST_AUTO_TEST_CASE(a_file_that_exists_is_gone_on_with)
{
    Folder folder;
    write(*open(folder), "1111");
    auto const file = open(folder);
    write(*file, "2222");
    write(*file, "3333");
    BOOST_TEST(folder.read("output.log.1") == "1111\n2222\n");
    BOOST_TEST(folder.read("output.log") == "3333\n");
}

BOOST_AUTO_TEST_CASE(a_line_longer_than_a_file_has_one_of_its_own)
{
    Folder folder;
    auto const file = open(folder);
    write(*file, std::string(30, 'x'));
    write(*file, "1");
    BOOST_TEST(folder.read("output.log.1").size() == 31u);
    BOOST_TEST(folder.read("output.log") == "1\n");
}

// As logrotate does.
BOOST_AUTO_TEST_CASE(a_file_that_was_renamed_gets_no_more_lines)
{
    Folder folder;
    auto const file = open(folder);
    write(*file, "1111");
    fs::rename(folder.path / "output.log", folder.path / "renamed");
    std::ofstream(folder.path / "output.log").close();
    write(*file, "2222");
    fs::remove(folder.path / "output.log");
    write(*file, "3333");
    BOOST_TEST(folder.read("renamed") == "1111\n");
    BOOST_TEST(folder.read("output.log") == "3333\n");
    BOOST_TEST((folder.names() == std::set<std::string>{"output.log", "renamed"}));
}

// A simulation may put anything in the place of the logs, at any time.
BOOST_AUTO_TEST_CASE(what_is_in_the_way_is_set_aside_and_the_log_says_so)
{
    Folder folder;
    std::ofstream(folder.path / "victim") << "precious";
    BOOST_REQUIRE(::mkfifo((folder.path / "output.log").c_str(), 0600) == 0);
    auto const file = std::make_unique<RotatingFile>(folder.path / "output.log", 1000, 2);
    file->set_formatter(std::make_unique<spdlog::pattern_formatter>("%v"));
    write(*file, "1111");
    BOOST_TEST(
        folder.read("output.log").find("was not what it has to be, and is now output.log.set-aside-") !=
        std::string::npos);
    BOOST_TEST(folder.read("output.log").ends_with("\n1111\n"));
    fs::remove(folder.path / "output.log");
    fs::create_symlink(folder.path / "victim", folder.path / "output.log");
    fs::create_directories(folder.path / "output.log.1" / "in_the_way");
    write(*file, std::string(1000, 'x'));
    write(*file, "2222");
    BOOST_TEST(folder.read("victim") == "precious");
    BOOST_TEST(folder.read("output.log").ends_with("2222\n"));
    BOOST_TEST(fs::is_regular_file(fs::symlink_status(folder.path / "output.log")));
}

BOOST_AUTO_TEST_SUITE_END()
