#include "finding.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>
#include <boost/json/value.hpp>

#include <algorithm>
#include <array>

namespace webots_cloud::core {
namespace {

constexpr std::size_t max_text = 2000; // of a field: words of other programs and servers may be in it
constexpr std::size_t widest_verdict = 7;
constexpr std::array<std::string_view, 3> colours{"\x1b[32m", "\x1b[33m", "\x1b[31m"}; // green, yellow, red
constexpr std::string_view no_colour = "\x1b[0m";

std::string padded(std::string_view text, std::size_t width)
{
    std::string line(text);
    line.resize(std::max(width, line.size()), ' ');
    return line;
}

std::size_t count(Findings const& findings, Verdict verdict)
{
    return static_cast<std::size_t>(std::ranges::count(findings, verdict, &Finding::verdict));
}

std::string counted(std::size_t number, std::string_view noun)
{
    return concat(std::to_string(number), " ", noun, number == 1 ? "" : "s");
}

boost::json::object findings_object(Findings const& findings)
{
    boost::json::array list;
    for (auto const& finding : findings) {
        boost::json::object each;
        each["verdict"] = to_string(finding.verdict);
        each["subject"] = printable(finding.subject, max_text);
        each["found"] = printable(finding.found, max_text);
        each["remedy"] = printable(finding.remedy, max_text);
        list.push_back(std::move(each));
    }
    boost::json::object all;
    all["verdict"] = to_string(worst(findings));
    all["findings"] = std::move(list);
    return all;
}

/// A member that is text; empty: there is none.
std::string_view text_of(boost::json::object const& object, std::string_view name)
{
    auto const* const value = object.if_contains(name);
    return value && value->is_string() ? std::string_view(value->get_string()) : std::string_view();
}

} // namespace

std::string_view to_string(Verdict verdict) noexcept
{
    static constexpr std::array<std::string_view, 3> words{"ok", "warning", "fault"};
    return words[static_cast<std::size_t>(verdict)];
}

Verdict worst(Findings const& findings) noexcept
{
    auto const found = std::ranges::max_element(findings, {}, &Finding::verdict);
    return found == findings.end() ? Verdict::ok : found->verdict;
}

std::string findings_text(Findings const& findings, bool coloured)
{
    std::size_t width = 0;
    for (auto const& finding : findings)
        width = std::max(width, finding.subject.size());
    std::string text;
    for (auto const& finding : findings) {
        auto const verdict = padded(to_string(finding.verdict), widest_verdict);
        auto const colour = colours[static_cast<std::size_t>(finding.verdict)];
        text += coloured ? concat(colour, verdict, no_colour) : verdict;
        text += concat("  ", padded(printable(finding.subject, max_text), width), "  ",
                       printable(finding.found, max_text));
        if (!finding.remedy.empty())
            text += concat(". ", printable(finding.remedy, max_text));
        text += "\n";
    }
    auto const faults = count(findings, Verdict::fault);
    auto const warnings = count(findings, Verdict::warning);
    text += faults + warnings == 0
                ? concat("All ", counted(findings.size(), "check"), " found nothing wrong.\n")
                : concat(counted(faults, "fault"), " and ", counted(warnings, "warning"), " in ",
                         counted(findings.size(), "check"), ".\n");
    return text;
}

std::string findings_json(Findings const& findings)
{
    return boost::json::serialize(findings_object(findings));
}

result<Findings> parse_findings(std::string_view json)
{
    auto const begin = std::min(json.find('{'), json.size());
    boost::json::error_code error;
    auto const all = boost::json::parse(trim(json.substr(begin)), error);
    auto const* const object = error ? nullptr : all.if_object();
    auto const* const list = object ? object->if_contains("findings") : nullptr;
    if (!list || !list->is_array())
        return Failure(errc::protocol_error, printable(trim(json), max_text));
    Findings findings;
    for (auto const& each : list->get_array()) {
        if (!each.is_object())
            continue;
        auto const& members = each.get_object();
        auto const word = text_of(members, "verdict");
        auto const verdict = word == "ok"        ? Verdict::ok
                             : word == "warning" ? Verdict::warning
                                                 : Verdict::fault;
        findings.emplace_back(verdict, text_of(members, "subject"), text_of(members, "found"),
                              text_of(members, "remedy"));
    }
    return findings;
}

std::string examination_json(Examination const& examination, std::string_view instance)
{
    auto all = findings_object(examination.findings);
    all["instance"] = instance;
    all["examined"] = nullptr;
    if (examination.when)
        all["examined"] = iso_time(*examination.when);
    all["underWay"] = examination.is_under_way;
    return boost::json::serialize(all);
}

} // namespace webots_cloud::core
