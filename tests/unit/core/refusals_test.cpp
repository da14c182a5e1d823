#include "unit_test.hpp"

#include "core/refusals.hpp"

#include <boost/json/parse.hpp>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

using namespace webots_cloud;
using core::Refused;
using core::refused;

BOOST_AUTO_TEST_SUITE(refusals)

namespace {

/// All sentences of Python servers that pages know (tests/viewer/session_test.mjs reads the same file).
boost::json::array python_refusals()
{
    std::ifstream file(SUPPORT_FOLDER "/python_refusals.json");
    std::string const text((std::istreambuf_iterator<char>(file)), {});
    return boost::json::parse(text).as_array();
}

std::vector<core::RefusalRow> all_rows()
{
    std::vector<core::RefusalRow> rows;
    for (std::size_t i = 0; i < static_cast<std::size_t>(Refused::count); ++i)
        rows.push_back(core::row_of(static_cast<Refused>(i)));
    return rows;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_sentence_is_filled_in_and_says_the_same_to_programs)
{
    auto const failure = refused(Refused::client_has_enough, {{"count", "2"}});
    BOOST_TEST(failure.message().starts_with("Your network has 2 simulations on this server already, "));
    BOOST_TEST((failure == errc::refused));
    BOOST_TEST_REQUIRE(failure.info());
    BOOST_TEST(failure.info()->code == "your-network");
    BOOST_TEST_REQUIRE(failure.info()->arguments.size() == 1u);
    BOOST_TEST(failure.info()->arguments[0].first == "count");
    BOOST_TEST(failure.info()->arguments[0].second == "2");
}

BOOST_AUTO_TEST_CASE(what_strangers_write_in_braces_is_not_filled_in)
{
    auto const failure = refused(Refused::site_fault, {{"site", "{why}"}, {"why", "{site} {"}});
    BOOST_TEST(failure.message() == "{why}: {site} {.");
}

BOOST_AUTO_TEST_CASE(another_kind_keeps_the_sentence_and_the_code)
{
    auto const full = make_error_code(boost::system::errc::no_space_on_device);
    auto const failure = refused(full, Refused::disk_full, {{"words", "No space left on device"}});
    BOOST_TEST((failure.code() == full));
    BOOST_TEST(failure.info()->code == "disk-full");
    BOOST_TEST(!core::where_refused(failure));
}

BOOST_AUTO_TEST_CASE(what_is_said_with_a_context_is_another_sentence)
{
    BOOST_TEST(!refused(Refused::quit).within("here").info());
    BOOST_TEST(!Failure(errc::refused, "no such thing").info());
}

BOOST_AUTO_TEST_CASE(rows_with_one_code_and_kind_send_a_start_to_the_same_machines)
{
    std::map<std::pair<std::string_view, errc>, core::StartRefusal> seen;
    for (auto const& row : all_rows()) {
        auto const found = seen.emplace(std::pair(row.code, row.kind), row.where).first;
        BOOST_TEST((found->second == row.where), row.sentence);
        FailureInfo info;
        info.code = row.code;
        BOOST_TEST((core::where_refused(Failure(row.kind, {}, info)) == row.where), row.sentence);
    }
}

BOOST_AUTO_TEST_CASE(codes_are_words_with_hyphens_and_sentences_are_printable)
{
    for (auto const& row : all_rows()) {
        BOOST_TEST(!row.code.empty());
        BOOST_TEST(std::ranges::all_of(row.code, [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; }),
                   row.code);
        BOOST_TEST(std::ranges::count(row.sentence, '{') == std::ranges::count(row.sentence, '}'),
                   row.sentence);
    }
}

// Else whoever changes the sentence has to change the part that names the value, too.
BOOST_AUTO_TEST_CASE(no_value_brings_the_punctuation_before_it)
{
    for (auto const& row : all_rows())
        for (auto at = row.sentence.find('{'); at != std::string_view::npos;
             at = row.sentence.find('{', at + 1)) {
            char const before = at == 0 ? ' ' : row.sentence[at - 1];
            BOOST_TEST((before == ' ' || before == '"' || before == ':' || before == '>' || before == '(' ||
                        before == '/'),
                       row.sentence);
        }
}

BOOST_AUTO_TEST_CASE(sentences_of_python_servers_are_known)
{
    auto const known = python_refusals();
    BOOST_TEST(known.size() > 10u);
    for (auto const& each : known) {
        std::string_view const sentence = each.at("sentence").as_string();
        auto const* const row = core::pythons_refusal(sentence);
        BOOST_TEST_REQUIRE(row, sentence);
        BOOST_TEST(row->code == std::string_view(each.at("code").as_string()), sentence);
    }
    for (auto const* other : {"", "Docker", "The project is larger than 2 MB.", "Webots has quit."})
        BOOST_TEST(!core::pythons_refusal(other), other);
}

BOOST_AUTO_TEST_CASE(errors_of_the_system_have_codes_too)
{
    using namespace boost::system::errc;
    BOOST_TEST(core::code_of_system(make_error_code(no_space_on_device)) == "disk-full");
    BOOST_TEST(core::code_of_system(make_error_code(permission_denied)) == "server-fault");
    BOOST_TEST(core::code_of_system(errc::not_found) == "");
    BOOST_TEST(core::code_of_system(Failure()) == "");
}

BOOST_AUTO_TEST_SUITE_END()
