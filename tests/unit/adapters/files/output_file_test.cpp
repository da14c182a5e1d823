// Writing files where a simulation may have put something else.
#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/files/output_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

using namespace webots_cloud;
using adapters::OutputFile;
using adapters::OutputMode;
namespace fs = std::filesystem;

namespace {

struct OutputFileFixture : ScratchFolder
{
    OutputFileFixture()
    {
        file = folder / "log" / "kind" / "output.log";
        victim = folder / "victim";
        std::ofstream(victim) << "precious";
    }
    static std::string read(fs::path const& path)
    {
        std::ostringstream text;
        text << std::ifstream(path).rdbuf();
        return text.str();
    }

    /// Opens the file, writes a line, and returns the notices.
    std::string write(OutputMode mode)
    {
        auto const output = adapters::open_output(file, mode, 0666);
        BOOST_TEST_REQUIRE(output.has_value());
        BOOST_TEST(::write(output->file.get(), "line", 4) == 4);
        return output->notice;
    }

    fs::path file;
    fs::path victim;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(output_file, OutputFileFixture)

BOOST_AUTO_TEST_CASE(a_file_is_gone_on_with_or_begun_anew_without_a_word)
{
    BOOST_TEST(write(OutputMode::append) == "");
    BOOST_TEST(write(OutputMode::append) == "");
    BOOST_TEST(read(file) == "lineline");
    BOOST_TEST(write(OutputMode::anew) == "");
    BOOST_TEST(read(file) == "line");
}

BOOST_AUTO_TEST_CASE(what_is_no_file_is_set_aside_and_nothing_else_is_touched)
{
    for (auto const mode : {OutputMode::append, OutputMode::anew})
        for (int what = 0; what < 5; ++what) {
            BOOST_TEST_CONTEXT(what)
            {
                fs::remove_all(folder / "log");
                fs::create_directories(file.parent_path());
                if (what == 0)
                    fs::create_symlink(victim, file);
                else if (what == 1)
                    BOOST_REQUIRE(::mkfifo(file.c_str(), 0600) == 0);
                else if (what == 2)
                    fs::create_directories(file / "inner");
                else if (what == 3)
                    fs::create_hard_link(victim, file);
                else
                    fs::create_symlink(folder / "nowhere", file);
                auto const notice = write(mode);
                BOOST_TEST(notice.find(file.string()) == 0u);
                BOOST_TEST(notice.find("output.log.set-aside-") != std::string::npos);
                BOOST_TEST(read(file) == "line");
                BOOST_TEST(fs::is_regular_file(fs::symlink_status(file)));
                BOOST_TEST(read(victim) == "precious");
                BOOST_TEST(!fs::exists(folder / "nowhere"));
            }
        }
}

BOOST_AUTO_TEST_CASE(what_is_in_the_place_of_its_folders_is_set_aside)
{
    for (auto const& place : {folder / "log", folder / "log" / "kind"}) {
        BOOST_TEST_CONTEXT(place)
        {
            fs::remove_all(folder / "log");
            fs::create_directories(place.parent_path());
            BOOST_REQUIRE(::mkfifo(place.c_str(), 0600) == 0);
            BOOST_TEST(write(OutputMode::append).find(place.string() + " was not what it has to be") == 0u);
            BOOST_TEST(read(file) == "line");
        }
    }
}

BOOST_AUTO_TEST_CASE(folders_may_be_links)
{
    fs::create_directories(folder / "elsewhere");
    fs::create_directories(folder / "log");
    fs::create_directory_symlink(folder / "elsewhere", folder / "log" / "kind");
    BOOST_TEST(write(OutputMode::append) == "");
    BOOST_TEST(read(folder / "elsewhere" / "output.log") == "line");
}

BOOST_AUTO_TEST_CASE(modes_that_keep_us_out_are_no_reason_to_give_up)
{
    constexpr uid_t nobody = 65534;
    auto const user = ::geteuid();
    if (user == 0) {
        BOOST_REQUIRE(::chown(folder.c_str(), nobody, static_cast<gid_t>(-1)) == 0);
        BOOST_REQUIRE(::seteuid(nobody) == 0);
    }
    BOOST_TEST(write(OutputMode::append) == "");
    BOOST_TEST(::chmod(file.c_str(), 0) == 0);
    BOOST_TEST(write(OutputMode::append).find("set-aside") != std::string::npos);
    BOOST_TEST(::chmod(file.parent_path().c_str(), 0) == 0);
    BOOST_TEST(write(OutputMode::append).find("had the mode of a folder that we can't use") !=
               std::string::npos);
    BOOST_TEST(read(file) == "lineline");
    BOOST_REQUIRE(::seteuid(user) == 0);
}

BOOST_AUTO_TEST_CASE(devices_are_never_moved)
{
    file = "/dev/null/kind/output.log";
    BOOST_TEST(!adapters::open_output(file, OutputMode::append, 0666).has_value());
    BOOST_TEST(fs::exists("/dev/null"));
}

BOOST_AUTO_TEST_SUITE_END()
