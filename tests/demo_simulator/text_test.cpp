#include "text.hpp"

#include <boost/test/unit_test.hpp>

#include <cmath>

using namespace webots_cloud::demo;

BOOST_AUTO_TEST_SUITE(text)

BOOST_AUTO_TEST_CASE(printable_keeps_utf8_and_replaces_the_rest)
{
    BOOST_TEST(printable("caf\xc3\xa9 \xf0\x9f\x92\xa5") == "caf\xc3\xa9 \xf0\x9f\x92\xa5");
    BOOST_TEST(printable("a\xff\xfe\nb\x7f") == "a???b?");
    BOOST_TEST(printable("\xc0\xaf") == "??", "an overlong form");
    BOOST_TEST(printable("\xed\xa0\x80") == "???", "a surrogate");
    BOOST_TEST(printable("\xf4\x90\x80\x80") == "????", "above U+10FFFF");
    BOOST_TEST(printable("\xe2\x82") == "??", "a cut sequence");
}

BOOST_AUTO_TEST_CASE(printable_cuts_between_characters)
{
    BOOST_TEST(printable("abc\xc3\xa9", 4) == "abc");
    BOOST_TEST(printable(std::string(1000, 'x')).size() == 200u);
}

BOOST_AUTO_TEST_CASE(numbers_have_six_digits_and_no_surprises)
{
    BOOST_TEST(number_text(0.1 + 0.2) == "0.3");
    BOOST_TEST(number_text(-1.0 / 3) == "-0.333333");
    BOOST_TEST(number_text(-1e-17) == "0");
    BOOST_TEST(number_text(std::nan("")) == "0");
}

BOOST_AUTO_TEST_CASE(xml_is_escaped)
{
    BOOST_TEST(xml_escaped("<a & 'b' \"c\">") == "&lt;a &amp; &apos;b&apos; &quot;c&quot;&gt;");
}

BOOST_AUTO_TEST_SUITE_END()
