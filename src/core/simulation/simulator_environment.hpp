// Which variables of the server's environment simulators get, and what the key `simulatorEnvironment` adds.
//
// Simulators run strangers' programs. They get what Webots, drivers, languages and networks need of the
// environment, as they would from a terminal, and nothing that looks like a secret or belongs to the server.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

using Environment = std::vector<std::pair<std::string, std::string>>;

/// What is wrong with an entry of `simulatorEnvironment`: what was expected instead. Empty: nothing is.
///
/// Entries are `NAME`, `PREFIX_*`, which pass on variables of the server, and `NAME=value`.
std::string_view wanted_instead(std::string_view entry);

/// An entry without its value, for messages.
std::string_view name_of_entry(std::string_view entry);

/// What `entries` alone give: of `ours`, and with the values that they set. Names go before patterns, and of
/// two entries with the same name the later counts.
///
/// A pattern finds nothing that looks like a secret: that has to be named.
Environment named_environment(Environment const& ours, std::vector<std::string> const& entries);

/// The environment of a simulator: of `ours` what it needs, what `entries` give, and `display` as `DISPLAY`.
/// Empty: nothing in it leads to a screen of the machine.
Environment simulator_environment(Environment const& ours, std::vector<std::string> const& entries,
                                  std::string_view display);

/// The value of a variable; empty when it is not set.
std::string value_of(Environment const& environment, std::string_view name);

/// Sets a variable, or replaces its value.
void set_variable(Environment& environment, std::string_view name, std::string_view value);

/// Removes a variable, if it is there.
void remove_variable(Environment& environment, std::string_view name);

/// What the operator should know of the variables that simulators do not get.
struct EnvironmentRemarks
{
    EnvironmentRemarks() = default;

    std::vector<std::string> notices;  ///< A sentence each, with names only.
    std::vector<std::string> warnings; ///< The same, of what a site may miss.
};

EnvironmentRemarks environment_remarks(Environment const& ours, std::vector<std::string> const& entries);

} // namespace webots_cloud::core
