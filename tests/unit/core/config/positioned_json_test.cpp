#include "unit_test.hpp"

#include "core/config/positioned_json.hpp"

#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <random>

using namespace webots_cloud::core;

namespace json = boost::json;

BOOST_AUTO_TEST_SUITE(positioned_json)

namespace {

/// "3:7 a sentence", a line each.
std::string faults_of(std::string_view text)
{
    std::string lines;
    for (auto const& fault : read_positioned_json(text).faults)
        lines += line_and_column(text, fault.offset) + " " + fault.text + "\n";
    return lines;
}

void check_faults(std::string_view text, std::string_view wanted)
{
    BOOST_TEST(faults_of(text) == wanted, text << ":\n" << faults_of(text) << "instead of\n" << wanted);
}

} // namespace

BOOST_AUTO_TEST_CASE(everything_has_a_place)
{
    std::string_view const text =
        "{\n  \"a\": [1, {\"b\":  true}],\n\t\"\xc3\xa4\xc3\xb6\": \"x\", \"c\":-1.5e3}";
    auto const read = read_positioned_json(text);
    BOOST_TEST(read.faults.empty());
    BOOST_TEST(read.is_complete);
    BOOST_TEST(json::serialize(read.value) == json::serialize(json::parse(text)));
    auto const& a = read.place.members.at("a");
    BOOST_TEST(line_and_column(text, a.key) == "2:3");
    BOOST_TEST(line_and_column(text, a.value) == "2:8");
    BOOST_TEST(line_and_column(text, a.entries.at(1).members.at("b").value) == "2:19");
    BOOST_TEST(line_and_column(text, read.place.members.at("c").key) == "3:13", "characters, not bytes");
}

BOOST_AUTO_TEST_CASE(what_people_take_for_json_is_called_by_its_name)
{
    auto const comment = std::string(
        "JSON has no comments: remove this one, and what follows it up to the next key or value\n");
    check_faults("\xef\xbb\xbf{}",
                 "1:1 the file begins with a byte order mark, which is no JSON: save it as UTF-8 "
                 "without one (\"UTF-8\" instead of \"UTF-8 with BOM\")\n");
    check_faults("{\n// port\n\"a\": 1 # it\n, \"b\": /* two */ 2}",
                 "2:1 " + comment + "3:8 " + comment + "4:8 " + comment);
    check_faults("{\"a\": \"http://b\"}", "");
    check_faults("{\"a\": [1, 2,],\n}", "1:12 there is a comma after the last entry of the list\n"
                                        "1:14 there is a comma after the last entry of the object\n");
    check_faults("{'a': 'b'}",
                 "1:2 JSON has double quotes, no single ones\n1:7 JSON has double quotes, no single ones\n");
    check_faults("{\"a\": 5 s, \"b\": 10MB}", "1:7 a number has no unit\n1:17 a number has no unit\n");
    BOOST_TEST(read_positioned_json("{\"a\": 1 h 30min }").value.at("a") == "1 h 30min");
    check_faults("{\"a\": True, \"b\": off, \"c\": None}",
                 "1:7 JSON has true in place of True\n1:18 JSON has false in place of off\n"
                 "1:28 JSON has null in place of None\n");
    check_faults("{\"a\": 1\n\"b\": 2}", "1:8 a comma is missing here\n");
    check_faults("{\"a\": 1,, \"b\": 2}", "1:9 there is a comma too many\n");
    check_faults("{\"a\" 1, \"b\", \"c\" = 2}",
                 "1:5 a \":\" is missing after the key\n1:12 this key has no value\n"
                 "1:18 there is a \":\" between a key and its value\n");
    check_faults("{a: 1}", "1:2 a key is in double quotes\n");
    check_faults("{\"a\": hello}",
                 "1:7 this is neither a string in double quotes nor a number, true, false or null "
                 "(syntax error)\n");
    check_faults("{\"a\": \"b,\n\"c\": 1}", "1:7 this string has no quote at its end\n");
    check_faults(R"({"a": "C:\worlds", "b": "\\w"})",
                 "1:7 a backslash in a string is written twice, as in \"C:\\\\worlds\"\n");
    check_faults(R"({"a": "\u12"})", "1:7 this string can't be read (expected hex digit at 1:12)\n");
    check_faults("{\"a\": 01999}",
                 "1:7 this is neither a string in double quotes nor a number, true, false or null "
                 "(extra data): write 1999, without zeros in front\n");
}

BOOST_AUTO_TEST_CASE(what_other_programs_have_written_is_one_fault)
{
    std::string_view const text = "{\n\"a\": 1}";
    std::string little("\xff\xfe");
    std::string big("\xfe\xff");
    for (char const c : text) {
        little += {c, '\0'};
        big += {'\0', c};
    }
    auto const utf16 = "1:1 the file is in UTF-16: save it as UTF-8\n";
    for (auto const& file : {little, big, little.substr(2), big.substr(2)})
        check_faults(file, utf16);
    check_faults(std::string_view("{\0\0\0\n\0\0\0", 8), "1:1 the file is in UTF-32: save it as UTF-8\n");
    check_faults("{\"a\": \"m\xe4x\"}", "1:7 this is no UTF-8: save the file as UTF-8\n");
    check_faults(
        "{\xe2\x80\x9c"
        "a\xe2\x80\x9d: \xe2\x80\x9e"
        "b\xe2\x80\x9c, \"c\": 1}",
        "1:2 these are typographic quotation marks, as those of word processors and web pages: write \" "
        "around every string\n");
    check_faults(
        "{\xc2\xa0\"a\":\xc2\xa0"
        "1}",
        "1:2 here is a character that looks like a space and is none, as those of word processors and web "
        "pages: write a space\n");
    for (auto const* other : {"port: 2000\nserver: h\n", "\x1f\x8b\x08", "server = h"})
        check_faults(other, "1:1 a configuration begins with {, and this does not\n");
    check_faults("{\r\n\"a\": 1\r\n}\r\n", "");
    check_faults("{\r\n\"a\": 1\r\n\"b\": 2}", "2:7 a comma is missing here\n");
}

BOOST_AUTO_TEST_CASE(what_comes_to_an_end_too_early_or_too_late_is_told)
{
    check_faults("", "1:1 the file is empty\n");
    check_faults("{} {}", "1:4 the configuration has ended before this\n");
    check_faults("{\n \"a\": [1,\n", "3:1 the file ends within the list that begins at 2:7\n");
    check_faults("{\"a\": [1}", "1:9 expected \",\" or \"]\", for the list that begins at 1:7\n");
    check_faults("{\"a\":}", "1:6 a value is missing here\n");
    auto const cut = read_positioned_json("{\"a\": 1, \"b\"");
    BOOST_TEST(!cut.is_complete);
    BOOST_TEST(cut.value.at("a") == 1);
    BOOST_TEST(!read_positioned_json(std::string(100'000, '[')).is_complete);
    BOOST_TEST(read_positioned_json("{" + std::string(100'000, ',')).faults.size() <= 201u);
}

BOOST_AUTO_TEST_CASE(of_two_members_with_one_name_the_last_counts)
{
    std::string_view const text = "{\"a\": 1,\n \"a\": 2}";
    auto const read = read_positioned_json(text);
    BOOST_TEST(read.faults.empty());
    BOOST_TEST(read.value.at("a") == 2);
    BOOST_TEST_REQUIRE(read.duplicates.size() == 1u);
    BOOST_TEST(line_and_column(text, read.duplicates[0].offset) == "2:2");
    BOOST_TEST(read.duplicates[0].text ==
               "key \"a\" is here for the second time, and counts; that at 1:2 does not");
}

// The twin is Boost.JSON: it takes what has no faults, and nothing else, and finds the same in it.
BOOST_AUTO_TEST_CASE(what_has_no_fault_is_what_boost_takes)
{
    std::mt19937 random(7); // the same texts each time
    std::string_view const pieces[] = {"{",     "}",        "[",    "]",           ":",       ",",  "\"a\"",
                                       "\"b\"", "1",        "-2",   "0.5e-3",      " ",       "\n", "true",
                                       "null",  "//x\n",    "'c'",  "\"\\u00e4\"", "#",       "01", "\"",
                                       "\\\"",  "\xc3\xa4", "\x01", "1e400",       "{\"a\":", "[1,"};
    int valid = 0;
    constexpr int tries = webots_cloud::is_sanitized ? 20'000 : 200'000;
    for (int i = 0; i < tries; ++i) {
        std::string text = i % 2 ? "{\"a\":" : "";
        for (auto count = random() % 9; count > 0; --count)
            text += pieces[random() % std::size(pieces)];
        text += i % 2 ? "}" : "";
        boost::system::error_code error;
        auto const value = json::parse(text, error);
        auto const read = read_positioned_json(text);
        BOOST_TEST_REQUIRE(read.faults.empty() == !error, text << ": " << error.message() << "\n"
                                                               << faults_of(text));
        if (error)
            continue;
        ++valid;
        BOOST_TEST_REQUIRE(json::serialize(read.value) == json::serialize(value), text);
    }
    BOOST_TEST(valid > tries / 40);
}

BOOST_AUTO_TEST_SUITE_END()
