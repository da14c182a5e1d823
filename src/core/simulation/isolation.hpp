// How simulations are isolated from the server and from each other, and the warnings where that does not
// work.
#pragma once

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// What the guard of simulations can do on this machine.
struct Isolation
{
    Isolation() = default;

    bool pid_namespace = false; ///< A simulation can signal only its own processes, and dies with its guard.
    bool signals = false;       ///< Without a namespace: it can signal only its own processes.
    bool own_proc = false;      ///< It sees only its own processes.
    bool read_only = false;     ///< It can't change the cache and the logs.
    std::string reason;         ///< Why there is no namespace.

    bool operator==(Isolation const&) const = default;
};

/// Reads what `webots-process-guard --probe` has printed.   Errors: `protocol_error`.
result<Isolation> parse_isolation(std::string_view text);

/// A sentence for the operator: what is missing, what that means, and what to do. Empty: simulations are kept
/// apart.
std::string isolation_warning(Isolation const& isolation);

/// Other warnings, a sentence each.
std::vector<std::string> isolation_remarks(Isolation const& isolation, bool is_root);

} // namespace webots_cloud::core
