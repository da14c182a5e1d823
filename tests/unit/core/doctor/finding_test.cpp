#include "unit_test.hpp"

#include "core/doctor/finding.hpp"
#include "core/text.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(finding)

namespace {

Findings some_findings()
{
    return {{Verdict::ok, "clock", "it is kept right"},
            {Verdict::warning, "memory", "little is left", "Add some."},
            {Verdict::ok, "port 2000", "it is free"}};
}

} // namespace

BOOST_AUTO_TEST_CASE(each_finding_is_a_line_with_its_remedy)
{
    BOOST_TEST(findings_text(some_findings(), false) == "ok       clock      it is kept right\n"
                                                        "warning  memory     little is left. Add some.\n"
                                                        "ok       port 2000  it is free\n"
                                                        "0 faults and 1 warning in 3 checks.\n");
    BOOST_TEST(findings_text({{Verdict::ok, "clock", "good"}}, false) ==
               "ok       clock  good\nAll 1 check found nothing wrong.\n");
}

BOOST_AUTO_TEST_CASE(on_a_terminal_verdicts_have_colours)
{
    BOOST_TEST(findings_text({{Verdict::fault, "port 80", "taken"}}, true) ==
               "\x1b[31mfault  \x1b[0m  port 80  taken\n1 fault and 0 warnings in 1 check.\n");
}

BOOST_AUTO_TEST_CASE(words_of_others_do_not_steer_the_terminal)
{
    BOOST_TEST(findings_text({{Verdict::ok, "machine a", "says \x1b[2J\n"}}, false)
                   .starts_with("ok       machine a  says \\x1b[2J\\x0a\n"));
}

BOOST_AUTO_TEST_CASE(the_worst_finding_counts)
{
    BOOST_TEST((worst({}) == Verdict::ok));
    BOOST_TEST((worst(some_findings()) == Verdict::warning));
    auto findings = some_findings();
    findings.insert(findings.begin(), {Verdict::fault, "port 80", "taken"});
    BOOST_TEST((worst(findings) == Verdict::fault));
}

BOOST_AUTO_TEST_CASE(programs_get_json)
{
    BOOST_TEST(findings_json({{Verdict::warning, "memory", "little is left", "Add some."}}) ==
               R"({"verdict":"warning","findings":[{"verdict":"warning","subject":"memory",)"
               R"("found":"little is left","remedy":"Add some."}]})");
}

BOOST_AUTO_TEST_CASE(what_was_written_is_read)
{
    auto const read = parse_findings(concat("Some remark.\n", findings_json(some_findings()), "\n"));
    BOOST_REQUIRE(read.has_value());
    BOOST_TEST((*read == some_findings()));
}

BOOST_AUTO_TEST_CASE(what_is_no_list_of_findings_is_refused_with_its_text)
{
    for (auto const* const text : {"", "Unknown assignment: Foo=1", "{", "[]", "{}", R"({"findings":1})"}) {
        auto const read = parse_findings(text);
        BOOST_REQUIRE(!read);
        BOOST_TEST(read.error().message().find(text) != std::string::npos);
    }
}

BOOST_AUTO_TEST_CASE(a_running_server_says_when_it_has_looked)
{
    Examination examination;
    BOOST_TEST(examination_json(examination, "abc") ==
               R"({"verdict":"ok","findings":[],"instance":"abc","examined":null,"underWay":false})");
    examination.when = WallTime() + std::chrono::hours(24);
    examination.is_under_way = true;
    BOOST_TEST(examination_json(examination, "abc")
                   .ends_with(R"("examined":"1970-01-02T00:00:00.000Z","underWay":true})"));
}

BOOST_AUTO_TEST_SUITE_END()
