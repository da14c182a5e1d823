#include "unit_test.hpp"

#include "core/simulation/isolation.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(isolation)

namespace {

bool says(std::string const& sentence, std::string_view words)
{
    return sentence.find(words) != std::string::npos;
}

} // namespace

BOOST_AUTO_TEST_CASE(what_the_guard_says_is_understood)
{
    auto const all = parse_isolation("namespace proc read-only\n").value();
    BOOST_TEST((all.pid_namespace && all.own_proc && all.read_only && !all.signals && all.reason.empty()));
    auto const some = parse_isolation("namespace\n").value();
    BOOST_TEST((some.pid_namespace && !some.own_proc && !some.read_only));
    auto const signals = parse_isolation("signals: Operation not permitted\n").value();
    BOOST_TEST((!signals.pid_namespace && signals.signals && signals.reason == "Operation not permitted"));
    auto const none = parse_isolation("none: No space: left on device\n").value();
    BOOST_TEST((!none.pid_namespace && !none.signals && none.reason == "No space: left on device"));
}

BOOST_AUTO_TEST_CASE(what_it_never_says_is_an_error)
{
    for (auto const* text : {"", "\n", "usage: guard", "namespaces", "\x1b[31m"}) {
        auto const parsed = parse_isolation(text);
        BOOST_TEST_REQUIRE(!parsed.has_value());
        BOOST_TEST((parsed.error() == errc::protocol_error));
        BOOST_TEST(!says(parsed.error().message(), "\x1b"));
    }
}

BOOST_AUTO_TEST_CASE(where_nothing_is_missing_nothing_is_said)
{
    auto const all = parse_isolation("namespace proc read-only").value();
    BOOST_TEST(isolation_warning(all) == "");
    BOOST_TEST(isolation_remarks(all, false).empty());
}

BOOST_AUTO_TEST_CASE(a_missing_namespace_is_named_with_what_it_means_and_what_to_do)
{
    auto const none = isolation_warning(parse_isolation("none: Operation not permitted").value());
    auto const signals = isolation_warning(parse_isolation("signals: Operation not permitted").value());
    for (auto const& sentence : {none, signals}) {
        BOOST_TEST(says(sentence, "no PID namespace can be made (Operation not permitted)"));
        BOOST_TEST(says(sentence, "allow user namespaces to the user of this server"));
    }
    BOOST_TEST(says(none, "can kill this server"));
    BOOST_TEST(says(signals, "can't signal or trace this server"));
    BOOST_TEST(says(isolation_warning(Isolation()), "for an unknown reason"));
}

BOOST_AUTO_TEST_CASE(a_cache_that_can_be_changed_and_a_server_of_roots_are_remarked)
{
    auto const remarks = isolation_remarks(parse_isolation("namespace proc").value(), true);
    BOOST_TEST_REQUIRE(remarks.size() == 2u);
    BOOST_TEST(says(remarks[0], "can change the cache"));
    BOOST_TEST(says(remarks[1], "runs as root"));
}

BOOST_AUTO_TEST_SUITE_END()
