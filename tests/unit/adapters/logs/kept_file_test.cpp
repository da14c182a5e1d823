// Files that are replaced as a whole.
#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/logs/kept_file.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/use_future.hpp>

#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

using namespace webots_cloud;
using adapters::KeptFile;
using adapters::make_kept_file;
namespace fs = std::filesystem;

namespace {

struct KeptFileFixture : ScratchFolder
{
    KeptFileFixture() { path = folder / "session" / "file.txt"; }
    result<> replace(KeptFile& file, std::string bytes)
    {
        boost::asio::io_context context;
        auto replaced =
            boost::asio::co_spawn(context, file.replace(std::move(bytes)), boost::asio::use_future);
        context.run();
        return replaced.get();
    }
    std::size_t files() const
    {
        return static_cast<std::size_t>(
            std::distance(fs::directory_iterator(path.parent_path()), fs::directory_iterator()));
    }

    fs::path path;
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(kept_file, KeptFileFixture)

BOOST_AUTO_TEST_CASE(what_was_written_is_read_again_and_is_for_its_owner_alone)
{
    auto const file = make_kept_file(path, 100);
    BOOST_TEST((file->read().error() == errc::not_found));
    for (std::string const& bytes : {std::string("first\n"), std::string("\0second", 7), std::string()}) {
        BOOST_TEST(replace(*file, bytes).has_value());
        BOOST_TEST(file->read().value() == bytes);
        struct stat status = {};
        BOOST_TEST_REQUIRE(::stat(path.c_str(), &status) == 0);
        BOOST_TEST((status.st_mode & 0777) == 0600u);
        BOOST_TEST(files() == 1u);
    }
    BOOST_TEST(make_kept_file(path, 100)->read().value().empty());
}

BOOST_AUTO_TEST_CASE(what_is_too_large_is_not_read)
{
    BOOST_TEST(replace(*make_kept_file(path, 100), std::string(101, 'x')).has_value());
    BOOST_TEST((make_kept_file(path, 100)->read().error() == errc::unavailable));
    BOOST_TEST(make_kept_file(path, 101)->read().has_value());
}

BOOST_AUTO_TEST_CASE(what_a_crash_has_left_is_in_nobodys_way)
{
    auto const file = make_kept_file(path, 100);
    BOOST_TEST(replace(*file, "old").has_value());
    fs::path left = path;
    left += ".new";
    std::ofstream(left) << "half";
    BOOST_TEST(file->read().value() == "old");
    BOOST_TEST(replace(*file, "new").has_value());
    BOOST_TEST(file->read().value() == "new");
    BOOST_TEST(files() == 1u);
}

BOOST_AUTO_TEST_CASE(where_it_cannot_be_replaced_the_old_one_stays)
{
    auto const file = make_kept_file(path, 100);
    fs::create_directories(path); // a folder of that name
    std::ofstream(path / "inside") << "x";
    BOOST_TEST((replace(*file, "new").error() == errc::unavailable));
    BOOST_TEST(fs::exists(path / "inside"));
    BOOST_TEST(files() == 1u);
    BOOST_TEST((file->read().error() == errc::not_found));
}

BOOST_AUTO_TEST_SUITE_END()
