#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

using namespace webots_cloud;
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

constexpr std::uint64_t kilobyte = 1024;
constexpr uid_t nobody = 65534;

/// An empty folder of an unprivileged user, as whom the test runs until its end.
struct FolderMeterFixture
{
    FolderMeterFixture()
    {
        auto name = (fs::temp_directory_path() / "webots_cloud_meter_XXXXXX").string();
        BOOST_TEST_REQUIRE(::mkdtemp(name.data()) != nullptr);
        folder = name;
        if (user == 0) {
            BOOST_TEST_REQUIRE(::chown(name.c_str(), nobody, static_cast<gid_t>(-1)) == 0);
            BOOST_TEST_REQUIRE(::seteuid(nobody) == 0);
        }
    }

    ~FolderMeterFixture()
    {
        BOOST_TEST(::seteuid(user) == 0);
        fs::remove_all(folder);
    }

    FolderUse measure(std::uint64_t enough = ~std::uint64_t{0})
    {
        // Its thread has the user of the process, unlike the test's.
        auto const meter = make_folder_meter();
        asio::io_context context;
        auto use = asio::co_spawn(context, meter->measure(folder, enough), asio::use_future);
        context.run();
        return use.get();
    }

    static void write(fs::path const& file, std::size_t kilobytes)
    {
        std::ofstream stream(file);
        stream << std::string(kilobytes * kilobyte, 'x') << std::flush;
        BOOST_TEST_REQUIRE(stream.good());
        int const opened = ::open(file.c_str(), O_RDONLY);
        BOOST_TEST(::fsync(opened) == 0); // now it has its blocks
        ::close(opened);
    }

    uid_t user = ::geteuid();
    fs::path folder;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(folder_meter, FolderMeterFixture)

BOOST_AUTO_TEST_CASE(files_of_all_folders_are_counted)
{
    write(folder / "a", 100);
    fs::create_directories(folder / "b" / "c");
    write(folder / "b" / "c" / "d", 200);
    auto const use = measure();
    BOOST_TEST(use.bytes >= 300 * kilobyte);
    BOOST_TEST(use.bytes < 400 * kilobyte);
    BOOST_TEST(!use.too_many_files);
    BOOST_TEST(use.free_bytes > 0U);
}

BOOST_AUTO_TEST_CASE(folders_that_their_owner_may_not_enter_hide_nothing)
{
    fs::create_directories(folder / "locked" / "inner");
    write(folder / "locked" / "inner" / "file", 100);
    fs::permissions(folder / "locked" / "inner", fs::perms::none);
    fs::permissions(folder / "locked", fs::perms::none);
    BOOST_TEST(measure().bytes >= 100 * kilobyte);
}

BOOST_AUTO_TEST_CASE(links_lead_nowhere)
{
    fs::create_symlink("/usr", folder / "link");
    BOOST_TEST(measure().bytes < 10 * kilobyte);
}

BOOST_AUTO_TEST_CASE(it_ends_once_it_has_found_enough)
{
    for (int i = 0; i < 10; ++i)
        write(folder / std::to_string(i), 100);
    auto const use = measure(150 * kilobyte);
    BOOST_TEST(use.bytes > 150 * kilobyte);
    BOOST_TEST(use.bytes < 400 * kilobyte);
}

BOOST_AUTO_TEST_CASE(folders_that_are_too_deep_are_too_many)
{
    fs::path path = folder;
    for (int i = 0; i < 70; ++i)
        path /= "d";
    fs::create_directories(path);
    BOOST_TEST(measure().too_many_files);
}

BOOST_AUTO_TEST_CASE(what_is_not_there_takes_nothing)
{
    fs::remove(folder);
    BOOST_TEST((measure() == FolderUse()));
}

BOOST_AUTO_TEST_SUITE_END()
