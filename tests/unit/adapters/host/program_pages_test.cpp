#include "unit_test.hpp"

#include "adapters/host/program_pages.hpp"

#include <fstream>
#include <limits>
#include <string>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(program_pages)

namespace {

/// Kilobytes of this process that are as in their files.
long pages_of_files()
{
    std::ifstream status("/proc/self/status");
    for (std::string name; status >> name;) {
        if (name == "RssFile:") {
            long size = 0;
            status >> size;
            return size;
        }
        status.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    }
    return 0;
}

} // namespace

BOOST_AUTO_TEST_CASE(what_only_the_start_needed_takes_no_memory_and_the_rest_goes_on)
{
    auto const before = pages_of_files();
    BOOST_TEST_REQUIRE(before > 0);
    adapters::release_program_pages();
    BOOST_TEST(pages_of_files() < before);
    BOOST_CHECK_THROW(throw std::string("tables of exceptions are such pages, too"), std::string);
}

BOOST_AUTO_TEST_SUITE_END()
