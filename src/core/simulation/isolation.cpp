#include "isolation.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {
namespace {

constexpr std::size_t max_reason_length = 200;
constexpr std::string_view remedy =
    ", until you allow user namespaces to the user of this server (docs/machine.md, \"Isolation\").";

} // namespace

result<Isolation> parse_isolation(std::string_view text)
{
    text = trim(text);
    auto const colon = text.find(": ");
    Isolation isolation;
    if (colon != std::string_view::npos)
        isolation.reason = printable(text.substr(colon + 2), max_reason_length);
    auto const words = split(text.substr(0, colon), ' ');
    auto const& first = words.front();
    if (first != "namespace" && first != "signals" && first != "none")
        return Failure(errc::protocol_error,
                       concat("the guard of simulations says \"", printable(text, max_reason_length),
                              "\", which means nothing"));
    isolation.pid_namespace = first == "namespace";
    isolation.signals = first == "signals";
    for (auto const word : words) {
        isolation.own_proc = isolation.own_proc || word == "proc";
        isolation.read_only = isolation.read_only || word == "read-only";
    }
    return isolation;
}

std::string isolation_warning(Isolation const& isolation)
{
    if (isolation.pid_namespace)
        return {};
    auto const missing = concat("no PID namespace can be made (",
                                isolation.reason.empty() ? "for an unknown reason" : isolation.reason, ")");
    if (isolation.signals)
        return concat("Simulations are kept apart in part only, since ", missing,
                      ": they can't signal or trace this server and each other, but they see all processes "
                      "of their user, and "
                      "can change the projects of others and the cache",
                      remedy);
    return concat("Simulations are not kept apart, since ", missing,
                  ": each of them can kill this server and the other simulations, and change the projects of "
                  "others and the "
                  "cache",
                  remedy);
}

std::vector<std::string> isolation_remarks(Isolation const& isolation, bool is_root)
{
    std::vector<std::string> remarks;
    if (isolation.pid_namespace && !isolation.read_only)
        remarks.emplace_back(
            "Simulations can change the cache of projects and the logs, since no mount namespace can be made "
            "for "
            "them. What was changed in the cache is fetched again, as far as it is noticed: see "
            "docs/machine.md, \"Isolation\".");
    if (is_root)
        remarks.emplace_back(
            "This server runs as root, and simulations with it: each of them can change every file of this "
            "machine. Run it as a user of its own.");
    return remarks;
}

} // namespace webots_cloud::core
