// Whose projects may run here: the operator's lists and the idle time that is shared with everybody else.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The operator's rules (protocol section 4.1.2, step 4).
struct RepositoryPolicy
{
    RepositoryPolicy() = default;

    std::vector<std::string> allowed; ///< URL prefixes that are always accepted.
    std::vector<std::string> blocked; ///< URL prefixes that are refused when idle time is shared.
    double share_idle_time = 50;      ///< Percent: the highest load at which other repositories are accepted; 0: never.
    bool docker = false;              ///< Simulations run in containers; without, strangers' projects are never run.
};

/// True when `prefix` names the same thing as `url` or something that contains it.
///
/// Compared by segments, so `https://github.com/cyberbotics` does not cover
/// `https://github.com/cyberbotics-evil`; scheme, host, owner and repository without case, as forges do;
/// `blob` and `tree` are the same. `url` is on `forge`, which says where its owner stands; its query and
/// fragment don't count.
bool covers(std::string_view prefix, std::string_view url, std::string_view forge);

/// Why a world of this forge must not run at this load, in the words that browsers know, or nothing when it
/// may.
std::optional<std::string> refusal(RepositoryPolicy const& policy, std::string_view url,
                                   std::string_view forge, double load);

} // namespace webots_cloud::core
