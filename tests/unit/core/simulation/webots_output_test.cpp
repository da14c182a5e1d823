#include "unit_test.hpp"

#include "core/simulation/webots_output.hpp"

#include <vector>

using namespace webots_cloud::core;

// Protocol section 6.4.
BOOST_AUTO_TEST_SUITE(webots_output)

namespace {

std::vector<std::string> lines_of(std::vector<std::string> const& chunks)
{
    std::vector<std::string> lines;
    auto const keep = [&](std::string_view line) { lines.emplace_back(line); };
    LineSplitter splitter;
    for (auto const& chunk : chunks)
        splitter.feed(chunk, keep);
    splitter.finish(keep);
    return lines;
}

} // namespace

BOOST_AUTO_TEST_CASE(lines_are_found_however_the_bytes_arrive)
{
    std::vector<std::string> const expected{"one", "", "two", "three"};
    BOOST_TEST(lines_of({"one\n\ntwo\r\nthr", "ee"}) == expected, boost::test_tools::per_element());
    BOOST_TEST(lines_of({"o", "ne", "\n", "\nt", "wo\r", "\nthree\n"}) == expected,
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(endless_lines_are_cut_and_cost_no_memory)
{
    std::vector<std::string> chunks(1000, std::string(10'000, 'x'));
    chunks.emplace_back("\n.\n");
    auto const lines = lines_of(chunks);
    BOOST_TEST_REQUIRE(lines.size() == 2u);
    BOOST_TEST(lines[0].size() == LineSplitter::max_line_length);
    BOOST_TEST(lines[1] == ".");
}

// Quirk Q21: `fast` runs too.
BOOST_AUTO_TEST_CASE(every_line_of_the_protocol_has_its_meaning)
{
    BOOST_TEST((classify_output(".") == OutputLine::heartbeat));
    BOOST_TEST((classify_output(".. anything after a dot") == OutputLine::heartbeat));
    BOOST_TEST((classify_output("open") == OutputLine::open));
    BOOST_TEST((classify_output("pause") == OutputLine::paused));
    for (auto const* line : {"real-time", "fast", "step"})
        BOOST_TEST((classify_output(line) == OutputLine::running), line);
    BOOST_TEST((classify_output("reset") == OutputLine::reset));
    BOOST_TEST((classify_output("display has ended: (EE) no memory left") == OutputLine::display_ended));
    for (auto const* line : {"", "opened", "the display has ended: x", "INFO: pause", "\xff\xfe"})
        BOOST_TEST((classify_output(line) == OutputLine::other), line);
}

BOOST_AUTO_TEST_SUITE_END()
