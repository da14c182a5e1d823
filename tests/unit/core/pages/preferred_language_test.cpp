#include "unit_test.hpp"

#include "core/pages/preferred_language.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(preferred_language_of_a_page)

namespace {

std::string_view chosen(std::string_view accept_language)
{
    return preferred_language(accept_language, {"en", "de", "fr"});
}

} // namespace

BOOST_AUTO_TEST_CASE(the_language_with_the_greatest_weight_is_chosen_and_the_first_of_equals)
{
    BOOST_TEST(chosen("de-DE,de;q=0.9,en-US;q=0.8,en;q=0.7") == "de"); // Chromium
    BOOST_TEST(chosen("fr,en-US;q=0.7,en;q=0.3") == "fr");             // Firefox
    BOOST_TEST(chosen("en;q=0.5, fr;q=0.75, de;q=0.625") == "fr");
    BOOST_TEST(chosen("de, fr") == "de");
    BOOST_TEST(chosen("DE-at ; q=0.1") == "de");
    BOOST_TEST(chosen("nl, fr;q=0.001") == "fr");
}

BOOST_AUTO_TEST_CASE(who_wants_none_of_them_gets_the_first)
{
    for (auto const* accept : {"", "*", "nl", "pt-BR,pt;q=0.9", "de;q=0", "de;q=0.000", "de;quite=much",
                               "de;q=", "de;q=x", "d", "deu", ",,;,-", ";q=1", "e\xff"})
        BOOST_TEST(chosen(accept) == "en", accept);
}

BOOST_AUTO_TEST_SUITE_END()
