#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <regex>

using namespace webots_cloud;
namespace fs = std::filesystem;

namespace {

struct LoggerFixture : ScratchFolder
{
    LoggerFixture() { params.file = folder / "log" / "output.log"; }
    std::string text() const
    {
        std::ifstream file(params.file);
        return {std::istreambuf_iterator<char>(file), {}};
    }

    LogParams params;
};

} // namespace

// Protocol section 9.1.
BOOST_FIXTURE_TEST_SUITE(logger, LoggerFixture)

BOOST_AUTO_TEST_CASE(lines_have_the_format_that_operators_know)
{
    {
        auto const log = make_logger(params).value();
        log.debug("nobody wants this");
        log.info("one");
        log.warning("two");
        log.error("three");
    }
    std::regex const expected(R"((\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} \[INFO   \]  one\n)"
                              R"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} \[WARNING\]  two\n)"
                              R"(\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} \[ERROR  \]  three\n))");
    BOOST_TEST(std::regex_match(text(), expected), text());
}

BOOST_AUTO_TEST_CASE(a_file_is_full_at_500_000_bytes_and_ten_old_ones_are_kept)
{
    {
        auto const log = make_logger(params).value();
        for (int i = 0; i < 14 * 1024; ++i) // some lines may be dropped: the queue is bounded
            log.info(std::string(450, 'x'));
    }
    BOOST_TEST(fs::file_size(params.file) <= 500'000u);
    BOOST_TEST(!fs::exists(folder / "log" / "output.11.log"));
    auto const files = std::distance(fs::directory_iterator(folder / "log"), {});
    BOOST_TEST(files <= 11);
    BOOST_TEST(files >= 2);
}

BOOST_AUTO_TEST_CASE(strangers_cannot_fill_it_and_what_they_did_is_told_at_the_end)
{
    {
        auto const log = make_logger(params).value();
        log.info("Running");
        for (int i = 0; i < 100'000; ++i)
            log.error(LogCause("failure", "7"), std::to_string(i) + std::string(450, 'x'));
        for (int i = 0; i < 100'000; ++i)
            log.warning(LogCause("answer", std::to_string(i)), std::string(450, 'x'));
        log.error("Stopping");
    }
    BOOST_TEST(!fs::exists(params.file.string() + ".1"));
    auto const lines = text();
    BOOST_TEST(lines.find("[INFO   ]  Running\n") == 24u);
    BOOST_TEST(lines.find("[ERROR  ]  Stopping\n") != std::string::npos);
    BOOST_TEST(lines.find(" (99989 more like this in the last ") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_line_stays_one_and_steers_no_terminal)
{
    make_logger(params)->warning("There is no folder /x\n2026-01-01 forged\x1b[2J\xc2\x9b\x9b caf\xc3\xa9");
    BOOST_TEST(text().substr(24) ==
               "[WARNING]  There is no folder /x\\x0a2026-01-01 forged\\x1b[2J\\xc2\\x9b\\x9b caf\xc3\xa9\n");
}

BOOST_AUTO_TEST_CASE(a_file_that_cannot_be_written_is_named_with_the_reason)
{
    params.file = "/proc/nowhere/output.log";
    auto const log = make_logger(params);
    BOOST_TEST((log.error() == errc::invalid_argument));
    BOOST_TEST(log.error().message().starts_with("Log file /proc/nowhere/output.log cannot be created: "));
}

BOOST_AUTO_TEST_SUITE_END()
