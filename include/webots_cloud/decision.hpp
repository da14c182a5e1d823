// What the Scheduler remembers of one placement: for GET /api/decisions, and to decide again.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/scheduling_policy.hpp>
#include <webots_cloud/time.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// One call of place() with all that led to its answer: a value of its own, no view of the scheduler.
///
/// Why `chosen` was chosen: with `least_committed` it has the smallest `score` of the entries with a
/// `position`, as far as `unseen_arrivals` lets the policy trust them. An entry without one has a `refusal`,
/// or is `overcommitted`. A place() that found nothing is `decisions().back()`, unless its labels made no
/// sense: that is no decision.
struct Decision
{
    Decision() = default;

    std::uint64_t id = 0;
    TimePoint at{};
    std::string policy;
    /// The server chosen; empty: none could be.
    std::string chosen;
    /// The state of the RandomSource that the policy was given.
    std::uint64_t random = 0;
    double unseen_arrivals = 0;
    /// How many machines were offered to the policy.
    std::size_t offered = 0;
    /// How many machines there were for each `Refusal`.
    std::array<std::size_t, refusal_count> refused{};
    /// What the session was believed to want, as a multiple of the average one, where its world was known.
    std::optional<double> expected_cost;
    /// Nobody was placed, although machines were offered: this many of `free_seats` were held for others.
    std::size_t held = 0;
    std::size_t free_seats = 0;

    /// One machine and its position in the snapshot; those that were not offered have none.
    struct Entry
    {
        Entry() = default;

        Candidate machine;
        std::string address;
        std::optional<std::size_t> position;
    };
    /// Fleets of up to 64 machines whole, in the operator's order; of larger ones the first 64 that the
    /// policy looked at. `machine.address` is empty here: `address` owns it.
    std::vector<Entry> machines;
    /// What the functions of the snapshot of these names last told the policy; empty where it did not ask.
    std::vector<std::size_t> lowest;
    std::optional<std::size_t> least_committed;
    std::optional<std::size_t> least_reported;
    /// Everything that the policy looked at is in `machines`, so replay() is possible.
    bool complete = true;
};

} // namespace webots_cloud
