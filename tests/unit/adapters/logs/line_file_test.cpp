#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/logs/line_file.hpp"

#include <boost/asio/io_context.hpp>

#include <cstdlib>
#include <fstream>
#include <iterator>

using namespace webots_cloud;
using adapters::make_line_file;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(line_file)

namespace {

struct LineFileFixture : ScratchFolder
{
    std::string text(std::string const& name) const
    {
        std::ifstream file(folder / name);
        return {std::istreambuf_iterator<char>(file), {}};
    }

    boost::asio::io_context context;
};

} // namespace

BOOST_FIXTURE_TEST_CASE(a_full_file_becomes_the_old_one_and_a_new_one_begins_with_the_heading,
                        LineFileFixture)
{
    {
        auto const append =
            make_line_file(context.get_executor(), "Test file", folder / "lines.csv", "head\n", Logger(), 15);
        for (auto const* line : {"1111\n", "2222\n", "3333\n", "4444\n", "5555\n"}) // two fill a file
            append(line);
    }
    BOOST_TEST(text("lines.csv") == "head\n5555\n");
    BOOST_TEST(text("lines.csv.1") == "head\n3333\n4444\n");
    BOOST_TEST(std::distance(fs::directory_iterator(folder), {}) == 2);
}

BOOST_FIXTURE_TEST_CASE(a_file_whose_name_cannot_be_changed_stays_bounded, LineFileFixture)
{
    fs::create_directories(folder / "lines.csv.1" / "in_the_way");
    {
        auto const append =
            make_line_file(context.get_executor(), "Test file", folder / "lines.csv", "head\n", Logger(), 12);
        for (auto const* line : {"1111\n", "2222\n", "3333\n"})
            append(line);
    }
    BOOST_TEST(text("lines.csv") == "head\n3333\n");
}

BOOST_AUTO_TEST_SUITE_END()
