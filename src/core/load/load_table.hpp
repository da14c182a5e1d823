// The poll table of protocol section 3 as a decision: what one poll of a simulation server means.
#pragma once

#include <webots_cloud/server_load.hpp>

namespace webots_cloud::core {

/// What changed with this poll, given what was known before.
///
/// A server that was never polled successfully counts as neither up nor down: its first failure is news, its
/// first answer is not.
LoadTransition classify(ServerLoad const& before, result<LoadReport> const& outcome,
                        double threshold) noexcept;

/// Counts a server in.
void add(LoadTotals& totals, ServerLoad const& server) noexcept;

/// What is known after the poll.
void apply(ServerLoad& known, result<LoadReport> const& outcome, TimePoint now);

} // namespace webots_cloud::core
