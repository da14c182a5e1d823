#include "unit_test.hpp"

#include "core/pages/page_language.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(page_language)

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

BOOST_AUTO_TEST_CASE(a_sentence_is_there_in_its_languages_and_in_english)
{
    Translations const texts(R"({"Yes.": {"de": "Ja.", "fr": "Oui."}})");
    BOOST_TEST(texts.languages_of("Yes.") == (std::vector<std::string_view>{"en", "de", "fr"}),
               boost::test_tools::per_element());
    BOOST_TEST(texts.languages_of("No.") == std::vector<std::string_view>{"en"},
               boost::test_tools::per_element());
    BOOST_TEST(texts.in("fr", "Yes.") == "Oui.");
    BOOST_TEST(texts.in("en", "Yes.") == "Yes.");
    BOOST_TEST(texts.in("ja", "Yes.") == "Yes.");
    BOOST_TEST(texts.in("de", "No.") == "No.");
}

BOOST_AUTO_TEST_SUITE_END()
