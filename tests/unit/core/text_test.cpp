#include "unit_test.hpp"

#include "core/text.hpp"

#include <limits>
#include <string>
#include <string_view>
#include <utility>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(text)

BOOST_AUTO_TEST_CASE(numbers_look_as_python_prints_them)
{
    BOOST_TEST(python_float(0) == "0.0");
    BOOST_TEST(python_float(7.875) == "7.875");
    BOOST_TEST(python_float(100) == "100.0");
    BOOST_TEST(python_float(0.1 + 0.2) == "0.30000000000000004");
    BOOST_TEST(python_float(1e16) == "1e+16");
    BOOST_TEST(python_float(123456789012345.0) == "123456789012345.0");
    BOOST_TEST(python_float(0.00001) == "1e-05");
    BOOST_TEST(python_float(-2.5) == "-2.5");
}

BOOST_AUTO_TEST_CASE(log_text_can_neither_break_lines_nor_steer_terminals)
{
    BOOST_TEST(printable("a\r\nb\x1b[31m") == "a\\x0d\\x0ab\\x1b[31m");
    BOOST_TEST(printable("\xff\xc3") == "\\xff\\xc3");
    BOOST_TEST(printable("\xc2\x9b") == "\\xc2\\x9b");
    BOOST_TEST(printable("caf\xc3\xa9") == "caf\xc3\xa9");
    BOOST_TEST(printable("abcdef", 3) == "abc...");
    BOOST_TEST(printable("a\u202etxt.exe") == "a\\xe2\\x80\\xaetxt.exe"); // would be read backwards
}

BOOST_AUTO_TEST_CASE(what_is_printable_already_is_left_alone)
{
    for (auto const* good : {"", "abc", "caf\xc3\xa9", "\xf0\x9f\xa4\x96 \\x1b", "\u2010\u2030\u3042"}) {
        BOOST_TEST(is_printable(good), good);
        BOOST_TEST(printable(good) == good);
    }
    for (auto const* bad : {"a\nb", "\t", "\x1b", "\x7f", "\xc2\x80", "\xc2\x9f", "\xff", "\xc3", "\u00ad",
                            "\u061c", "\u200b", "\u200d", "\u2028", "\u202e", "\u2066", "\ufeff"}) {
        BOOST_TEST(!is_printable(bad), bad);
        BOOST_TEST(is_printable(printable(bad)), bad);
    }
}

BOOST_AUTO_TEST_CASE(utf8_is_checked_strictly)
{
    BOOST_TEST(is_utf8("\xf0\x9f\xa4\x96 robot"));
    BOOST_TEST(!is_utf8("\xc0\xaf"));         // overlong slash
    BOOST_TEST(!is_utf8("\xed\xa0\x80"));     // surrogate
    BOOST_TEST(!is_utf8("\xf4\x90\x80\x80")); // beyond Unicode
    BOOST_TEST(!is_utf8("\xe2\x82"));         // cut off
}

BOOST_AUTO_TEST_CASE(only_letters_of_ascii_have_small_ones)
{
    BOOST_TEST(lower_case("AZaz@[`{09 \xC3\x89") == "azaz@[`{09 \xC3\x89");
}

BOOST_AUTO_TEST_CASE(html_is_escaped_for_content_and_attributes)
{
    BOOST_TEST(escape_html("<a href=\"x\" b='y'>&") == "&lt;a href=&quot;x&quot; b=&#39;y&#39;&gt;&amp;");
}

BOOST_AUTO_TEST_CASE(the_nearest_word_is_found_and_far_ones_are_not)
{
    BOOST_TEST(nearest("prot", {"server", "port", "portRewrite"}) == "port");
    BOOST_TEST(nearest("simulationServer", {"simulationServers", "server"}) == "simulationServers");
    BOOST_TEST(nearest("colour", {"port", "ssl"}) == "");
}

BOOST_AUTO_TEST_CASE(percent_escapes_are_decoded_or_refused)
{
    std::string decoded;
    BOOST_TEST(percent_decode("a%20b%2F", decoded));
    BOOST_TEST(decoded == "a b/");
    for (auto const* broken : {"%", "%1", "%g0", "a%0"})
        BOOST_TEST(!percent_decode(broken, decoded), broken);
}

BOOST_AUTO_TEST_CASE(splitting_keeps_empty_pieces)
{
    auto const pieces = split("/a//b", '/');
    BOOST_TEST(pieces.size() == 4u);
    BOOST_TEST(split("", '/').size() == 1u);
}

namespace {

template<class Text>
constexpr bool can_split = requires(Text text)
{
    split(std::forward<Text>(text), '/');
};

template<class Text>
constexpr bool can_trim = requires(Text text)
{
    trim(std::forward<Text>(text));
};

template<class Text>
constexpr bool can_cut_query = requires(Text text)
{
    without_query(std::forward<Text>(text));
};

} // namespace

BOOST_AUTO_TEST_CASE(views_are_made_of_what_outlives_the_statement)
{
    BOOST_TEST((can_split<std::string&> && can_split<std::string const&> && can_split<char const*>));
    BOOST_TEST((can_trim<std::string&> && can_trim<std::string const&> && can_trim<std::string_view>));
    BOOST_TEST((can_cut_query<std::string&> && can_cut_query<std::string const&>));
    BOOST_TEST((!can_split<std::string> && !can_split<std::string const>));
    BOOST_TEST((!can_trim<std::string> && !can_trim<std::string const>));
    BOOST_TEST((!can_cut_query<std::string> && !can_cut_query<std::string const>));
}

BOOST_AUTO_TEST_SUITE_END()
