#include "printed_lines.hpp"

#include <boost/test/unit_test.hpp>

#include <vector>

using namespace webots_cloud::demo;

BOOST_AUTO_TEST_SUITE(printed_lines)

namespace {

std::vector<std::string> all(PrintedLines& lines)
{
    std::vector<std::string> result;
    while (auto line = lines.next())
        result.push_back(*line);
    return result;
}

} // namespace

BOOST_AUTO_TEST_CASE(lines_come_whole)
{
    PrintedLines lines;
    lines.add("one\r\n\nth");
    BOOST_TEST(all(lines) == (std::vector<std::string>{"one", ""}), boost::test_tools::per_element());
    lines.add("ree\nrest");
    BOOST_TEST(all(lines) == std::vector<std::string>{"three"}, boost::test_tools::per_element());
    BOOST_TEST(lines.last().value() == "rest");
    BOOST_TEST(!lines.last().has_value());
}

BOOST_AUTO_TEST_CASE(a_line_without_end_becomes_several)
{
    PrintedLines lines;
    std::string const euro = "\xe2\x82\xac";
    std::string long_line;
    while (long_line.size() < 2 * PrintedLines::max_line + 100)
        long_line += euro;
    lines.add(long_line);
    std::string joined;
    for (auto const& line : all(lines)) {
        BOOST_TEST(line.size() <= PrintedLines::max_line);
        joined += line;
    }
    joined += lines.last().value();
    BOOST_TEST(joined == long_line); // no character was cut
}

BOOST_AUTO_TEST_CASE(what_browsers_refuse_is_replaced)
{
    PrintedLines lines;
    lines.add("\tx\xff\x1b[0m\n" + std::string(PrintedLines::max_line, '\t') + "\n");
    BOOST_TEST(lines.next().value() == "    x??[0m");
    BOOST_TEST(lines.next().value() == std::string(4 * PrintedLines::max_line, ' '));
}

BOOST_AUTO_TEST_SUITE_END()
