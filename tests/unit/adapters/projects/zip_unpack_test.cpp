// That unpacking is stopped. What may be in a zip file is tested in tests/integration/website_test.py and by
// the fuzzer `archive`.
#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/files/project_files.hpp"
#include "adapters/projects/zip_unpack.hpp"
#include "stored_zip.hpp"

#include <fcntl.h>
#include <sys/mman.h>

#include <filesystem>
#include <fstream>

using namespace webots_cloud;
using namespace webots_cloud::adapters;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(zip_unpack)

namespace {

/// Unpacks until the interrupt has been asked so many times.
struct Unpacking : ScratchFolder
{
    result<std::vector<std::string>> run(std::map<std::string, std::string> const& files, int times)
    {
        FileDescriptor const zip(::memfd_create("zip", MFD_CLOEXEC));
        BOOST_TEST_REQUIRE(write_all(zip.get(), stored_zip(files)).has_value());
        auto const root = open_folder(AT_FDCWD, folder.c_str());
        return unpack_zip(zip.get(), root->get(), UnpackLimits(), [&times]() -> result<> {
            return times-- > 0 ? result<>() : result<>(Failure(errc::timed_out, "enough"));
        });
    }
};

} // namespace

BOOST_FIXTURE_TEST_CASE(a_zip_becomes_files_and_folders, Unpacking)
{
    BOOST_TEST_REQUIRE(run({{"worlds/a.wbt", "#VRML_SIM\n"}, {"b", ""}}, 100).has_value());
    std::ifstream world(folder / "worlds" / "a.wbt");
    std::string line;
    BOOST_TEST(std::getline(world, line).good());
    BOOST_TEST(line == "#VRML_SIM");
    BOOST_TEST(fs::file_size(folder / "b") == 0u);
}

BOOST_FIXTURE_TEST_CASE(it_stops_within_a_file, Unpacking)
{
    auto const stopped = run({{"large", std::string(1'000'000, 'x')}}, 5);
    BOOST_TEST_REQUIRE(stopped.has_error());
    BOOST_TEST((stopped.error() == errc::timed_out));
    BOOST_TEST(fs::file_size(folder / "large") < 1'000'000u);
}

BOOST_FIXTURE_TEST_CASE(it_stops_between_files_that_are_empty, Unpacking)
{
    auto const stopped = run({{"1", ""}, {"2", ""}, {"3", ""}}, 2);
    BOOST_TEST_REQUIRE(stopped.has_error());
    BOOST_TEST((stopped.error() == errc::timed_out));
    BOOST_TEST(!fs::exists(folder / "3"));
}

BOOST_AUTO_TEST_SUITE_END()
