#include "unit_test.hpp"

#include "adapters/files/regular_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

using namespace webots_cloud;
namespace fs = std::filesystem;

namespace {

struct Folder
{
    Folder()
    {
        std::string name = (fs::temp_directory_path() / "webots_cloud_file_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        path = name;
    }
    ~Folder() { fs::remove_all(path); }

    fs::path pipe() const
    {
        auto const name = path / "pipe";
        BOOST_TEST_REQUIRE(::mkfifo(name.c_str(), 0600) == 0);
        return name;
    }

    fs::path path;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(regular_file, Folder)

BOOST_AUTO_TEST_CASE(a_file_is_read_whole_up_to_its_limit)
{
    std::ofstream(path / "file") << std::string(1000, 'x');
    BOOST_TEST(adapters::read_regular_file(path / "file", 1000).value() == std::string(1000, 'x'));
    BOOST_TEST(adapters::read_regular_file(path / "file", 999).error().message() ==
               "it is larger than 999 bytes");
    std::ofstream(path / "empty");
    BOOST_TEST(adapters::read_regular_file(path / "empty", 10).value().empty());
    BOOST_TEST(adapters::read_regular_file("/proc/self/status", 100'000)
                   .value()
                   .starts_with("Name:")); // whose size is 0
}

BOOST_AUTO_TEST_CASE(what_is_no_file_is_refused_and_nobody_waits_for_it)
{
    BOOST_TEST(adapters::read_regular_file(path / "none", 10).error().message() ==
               "No such file or directory");
    BOOST_TEST(adapters::read_regular_file(path, 10).error().message() == "it is a folder");
    BOOST_TEST(adapters::read_regular_file("/dev/zero", 10).error().message() == "it is no regular file");
    BOOST_TEST(adapters::read_regular_file(pipe(), 10).error().message() == "it is no regular file");
}

BOOST_AUTO_TEST_SUITE_END()
