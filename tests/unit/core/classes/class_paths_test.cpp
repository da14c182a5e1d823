#include "unit_test.hpp"

#include "core/classes/class_paths.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(class_paths)

BOOST_AUTO_TEST_CASE(a_code_is_the_page_and_a_name_with_a_dot_is_a_file)
{
    BOOST_TEST(class_file("/class/") == "class/index.html");
    BOOST_TEST(class_file("/class/K7M2Q") == "class/index.html");
    BOOST_TEST(class_file("/class/teacher.js") == "class/teacher.js");
    BOOST_TEST(class_file("/class/a/b") == "class/a/b");
    BOOST_TEST(class_file("/class/view/session.js") == "view/session.js");
    BOOST_TEST(class_file("/class/view/texts/en.json") == "view/texts/en.json");
    BOOST_TEST(class_file("/class/base.css") == "viewer/base.css");
    BOOST_TEST(class_file("/class/page.css") == "viewer/page.css");
    BOOST_TEST(class_file("/class") == "");
    BOOST_TEST(class_file("/classroom") == "");
}

BOOST_AUTO_TEST_CASE(a_token_stands_anywhere_in_the_query)
{
    BOOST_TEST(class_token("class=t") == "t");
    BOOST_TEST(class_token("url=https://e.org/a.wbt&class=t") == "t");
    BOOST_TEST(class_token("class=t&url=x") == "t");
    for (auto const* query : {"", "&", "url=x", "aclass=t", "class", "class=", "&&class=&"})
        BOOST_TEST(class_token(query) == "", query);
}

BOOST_AUTO_TEST_SUITE_END()
