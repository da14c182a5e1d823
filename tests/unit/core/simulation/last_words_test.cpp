#include "unit_test.hpp"

#include "core/simulation/last_words.hpp"

using webots_cloud::core::last_words;
using webots_cloud::core::LastWords;

BOOST_AUTO_TEST_SUITE(last_words_of_programs)

BOOST_AUTO_TEST_CASE(the_error_is_quoted_and_not_the_advice_after_it)
{
    BOOST_TEST(last_words("webots: invalid value \"x3d\" to '--stream' option.\n"
                          "Try 'webots --help' for more information.\n") ==
               "webots: invalid value \"x3d\" to '--stream' option.");
    BOOST_TEST(last_words("qt.qpa.xcb: could not connect to display :0\n\nAvailable platform plugins are: "
                          "xcb, offscreen.\n\n") == "qt.qpa.xcb: could not connect to display :0");
}

BOOST_AUTO_TEST_CASE(of_several_errors_the_last_one_is_quoted)
{
    BOOST_TEST(
        last_words("WARNING: the texture is MISSING\nTraceback (most recent call last):\n  File \"a.py\"\n"
                   "ModuleNotFoundError: No module named 'numpy'\nGood bye.") ==
        "ModuleNotFoundError: No module named 'numpy'");
}

BOOST_AUTO_TEST_CASE(without_an_error_the_last_line_that_is_not_blank_is_quoted)
{
    BOOST_TEST(last_words("starting\nloading the world\r\n  \n\n") == "loading the world");
    BOOST_TEST(last_words("") == "");
    BOOST_TEST(last_words(" \n") == "");
}

BOOST_AUTO_TEST_CASE(a_default_is_no_fault)
{
    BOOST_TEST(last_words("Step 2/9 : FROM ${WEBOTS_DEFAULT_IMAGE}\nunauthorized") == "unauthorized");
    BOOST_TEST(last_words("Segmentation fault (core dumped)\nbye") == "Segmentation fault (core dumped)");
    BOOST_TEST(last_words("webots-bin[7]: segfault at 0\nbye") == "webots-bin[7]: segfault at 0");
}

BOOST_AUTO_TEST_CASE(long_lines_are_cut_where_they_are_kept)
{
    LastWords words;
    words.add(std::string(100'000, 'x'));
    BOOST_TEST(words.text().size() == 400u);
}

BOOST_AUTO_TEST_SUITE_END()
