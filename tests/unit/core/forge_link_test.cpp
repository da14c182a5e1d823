#include "unit_test.hpp"

#include "core/forge_link.hpp"

using namespace webots_cloud;
using core::forge_link;
using core::LinkView;

// What worlds make of them: tests/unit/core/projects/project_ref_test.cpp.
BOOST_AUTO_TEST_SUITE(forge_links)

BOOST_AUTO_TEST_CASE(a_link_that_ends_early_has_a_repository_and_nothing_in_it)
{
    for (auto const* path : {"o/r/tree", "o/r/tree/", "o/r/-/tree", "o/r/src/branch", "o/r/src/tag/"}) {
        auto const link = forge_link(path, ForgeKind::unknown);
        BOOST_TEST_REQUIRE(link.has_value(), path);
        BOOST_TEST(link->names == "o/r", path);
        BOOST_TEST(link->rest == "", path);
        BOOST_TEST((link->view == LinkView::folder), path);
    }
    for (auto const* path :
         {"", "/", "o", "tree", "o/tree", "o/r", "o/r/", "o/r/-", "o/r/-/", "o/r/-/src/x", "-/-/x"})
        BOOST_TEST(!forge_link(path, ForgeKind::unknown).has_value(), path);
}

BOOST_AUTO_TEST_CASE(the_first_page_counts)
{
    auto const link = forge_link("o/r/blob/tree/src/-/raw/x", ForgeKind::unknown);
    BOOST_TEST_REQUIRE(link.has_value());
    BOOST_TEST(link->names == "o/r");
    BOOST_TEST(link->rest == "tree/src/-/raw/x");
    BOOST_TEST((link->view == LinkView::file));
}

BOOST_AUTO_TEST_CASE(other_hosts_of_a_forge_are_the_usual_one)
{
    BOOST_TEST(core::usual_address("https://raw.githubusercontent.com/o/r/main/a?x") ==
               "https://github.com/o/r/raw/main/a?x");
    BOOST_TEST(core::usual_address("https://raw.githubusercontent.com/o/r") == "https://github.com/o/r");
    BOOST_TEST(core::usual_address("https://raw.githubusercontent.com/") == "https://github.com/");
    BOOST_TEST(core::usual_address("https://github.dev/o/r/blob/main/a") ==
               "https://github.com/o/r/blob/main/a");
    for (auto const* other :
         {"", "https://github.com", "https://github.com/o/r", "local:/o/r/raw/x",
          "http://raw.githubusercontent.com/o/r/main/a", "https://x.org/https://github.dev/o"})
        BOOST_TEST(core::usual_address(other) == other);
}

BOOST_AUTO_TEST_CASE(kinds_have_the_names_that_configurations_use)
{
    for (auto const& row : forge_kinds) {
        BOOST_TEST((core::forge_kind(row.name) == row.kind), row.name);
        BOOST_TEST((row.site.empty() || kind_of_forge(row.site) == row.kind), row.name);
    }
    BOOST_TEST((core::forge_kind("forgejo") == core::forge_kind("gitea")));
    BOOST_TEST((core::forge_kind("") == ForgeKind::unknown));
    BOOST_TEST((kind_of_forge("https://github.com") == ForgeKind::github));
    BOOST_TEST((kind_of_forge("https://github.com.lab.org") == ForgeKind::unknown));
    BOOST_TEST((kind_of_forge("") == ForgeKind::unknown));
}

BOOST_AUTO_TEST_SUITE_END()
