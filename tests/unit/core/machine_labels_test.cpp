#include "unit_test.hpp"

#include "core/machine_labels.hpp"

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(machine_labels)

using Labels = std::vector<std::string>;

BOOST_AUTO_TEST_CASE(a_label_is_a_word)
{
    for (auto const* text : {"gpu", "R2025a", "ubuntu22.04", "a_b-c+d", "1"})
        BOOST_TEST(core::is_label(text), text);
    for (auto const* text : {"", " ", "a b", "a,b", "ä", "a\n", "a/b", "\""})
        BOOST_TEST(!core::is_label(text), text);
    BOOST_TEST(core::is_label(std::string(40, 'a')));
    BOOST_TEST(!core::is_label(std::string(41, 'a')));
}

BOOST_AUTO_TEST_CASE(the_release_is_the_first_line_of_the_version)
{
    BOOST_TEST(core::webots_release("R2025a\n") == "R2025a");
    BOOST_TEST(core::webots_release("R2023b-rev1\r\nmore") == "R2023b-rev1");
    for (auto const* text : {"", "\nR2025a", "8.6.2", "Rolling", "R2025a of today", "<html>"})
        BOOST_TEST(core::webots_release(text) == "", text);
}

BOOST_AUTO_TEST_CASE(a_machine_adds_what_it_knows_itself)
{
    BOOST_TEST((core::machine_labels({"gpu"}, false, "R2025a\n") == Labels{"gpu", "R2025a"}));
    BOOST_TEST((core::machine_labels({"R2025a"}, false, "R2025a\n") == Labels{"R2025a"}));
    BOOST_TEST((core::machine_labels({}, false, "") == Labels{}));
    BOOST_TEST((core::machine_labels({}, true, "R2025a\n") == Labels{"docker"}),
               "containers have any Webots");
}

BOOST_AUTO_TEST_SUITE_END()
