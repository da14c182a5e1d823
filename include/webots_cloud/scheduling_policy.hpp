// What a policy of the Scheduler chooses from, and the four that there are. A policy of your own in ten
// lines: examples/06_own_policy.cpp.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Why a machine is not offered.
enum class Refusal : std::uint8_t
{
    none,      ///< It is offered.
    unknown,   ///< It has never reported, whether or not polls of it have failed.
    lost,      ///< It has reported, but its last poll failed.
    stale,     ///< Its last report is older than `report_lifetime`.
    draining,  ///< It says so itself, or the operator does.
    full,      ///< Its sessions reach its `capacity`.
    memory,    ///< Its memory in use, with what its starting sessions will need, reaches `memory_threshold`.
    load,      ///< Its reported load reaches `threshold`.
    committed, ///< Its reported load does not reach `threshold`, but does with its starting sessions.
    labels,    ///< It lacks a label that this request needs: only in a `Decision`.
    excluded,  ///< This request does not want it: only in a `Decision`.
    room,      ///< This session would make it over-full (`must_fit`): only in a `Decision`.
};
inline constexpr std::size_t refusal_count = 12;

/// The name of a reason, as in `GET /api/decisions`.
std::string_view to_string(Refusal reason) noexcept;

/// What a policy knows about a machine. Percentages are of that machine.
struct Candidate
{
    Candidate() = default;

    std::string_view address; ///< Valid as long as the snapshot that it came from; empty in a `Decision`.
    double load = 0;          ///< Percent: the last report, untouched.
    /// Percent: the smoothed load, and what placed sessions will add to it. May be below `load`.
    double committed = 0;
    double score = 0;  ///< What `least_committed` minimises: `committed` with one session more, weighted.
    double cost = 0;   ///< Percent: how much one session moves the load, as learned.
    double weight = 1; ///< The operator's `ServerSpec::weight`.
    int sessions = 0;  ///< As reported; 0 where the machine reports a bare number.
    int pending = 0;   ///< Placed here, neither confirmed by a report nor timed out.
    Refusal refusal = Refusal::none; ///< Always `none` in a snapshot; a `Decision` lists refused ones too.
    /// Counting placements that no browser has claimed yet, it would be refused as `full`, `memory` or
    /// `committed`. It is offered only while every machine is like that.
    bool overcommitted = false;
    /// It has the project of this request in its cache, and its score was lowered for that.
    bool warm = false;

    bool operator==(Candidate const&) const = default;
};

/// The random numbers of one decision: SplitMix64 (Steele, Lea, Flood 2014), a UniformRandomBitGenerator.
///
/// Own code instead of std::mt19937_64 because its state is 8 bytes instead of 2.5 kB, so that every decision
/// can keep it and be replayed, and because its numbers are the same with every standard library.
class RandomSource
{
public:
    using result_type = std::uint64_t;

    explicit RandomSource(std::uint64_t seed = 0) noexcept : state_(seed) {}

    static constexpr result_type min() noexcept { return 0; }
    static constexpr result_type max() noexcept { return std::numeric_limits<result_type>::max(); }
    result_type operator()() noexcept
    {
        state_ += 0x9e3779b97f4a7c15u;
        std::uint64_t mixed = (state_ ^ (state_ >> 30)) * 0xbf58476d1ce4e5b9u;
        mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
        return mixed ^ (mixed >> 31);
    }
    /// A real number, 0 <= number < 1.
    double uniform() noexcept { return static_cast<double>((*this)() >> 11) * 0x1p-53; }
    /// An integer, 0 <= number < `count`.
    /// Precondition: `count` > 0.
    std::size_t below(std::size_t count) noexcept
    {
        return static_cast<std::size_t>(uniform() * static_cast<double>(count));
    }

private:
    std::uint64_t state_;
};

/// The machines that may take a session at one moment: what a policy chooses from.
///
/// A view, never a copy: it costs nothing to make, however many machines there are. Positions begin with 0
/// and are in no particular order. Everything that a policy reads is written down, so that its decision can
/// be replayed.
class PlacementSnapshot
{
public:
    virtual ~PlacementSnapshot() = default;

    /// How many machines may take a session; at least 1 when a policy is asked.
    virtual std::size_t size() const = 0;
    /// Precondition: `position` < size().
    virtual Candidate operator[](std::size_t position) const = 0;
    /// The machine of the smallest `score`; of equals, the one that was given a session longest ago.
    /// O(log n).
    virtual std::size_t least_committed() const = 0;
    /// The machine of the smallest `load`; of equals likewise.
    virtual std::size_t least_reported() const = 0;
    /// Fills `positions` with the machines of the smallest scores, in that order; returns how many there are.
    ///
    /// Looks at one of `parts` parts of the fleet: the one that holds the share `where` (0 <= where < 1) of
    /// the machines, in whatever order. Parts are about equal; one may be empty of machines that can take a
    /// session. O(k log n) for k positions, k at most `max_lowest`.
    virtual std::size_t lowest(std::span<std::size_t> positions, std::size_t parts, double where) const = 0;
    /// How many sessions others have probably placed on these machines since their reports.
    virtual double unseen_arrivals() const = 0;

    static constexpr std::size_t max_lowest = 16;
};

/// Chooses a position of the snapshot. Pure: what it returns depends on its two arguments only.
using SchedulingPolicy = std::function<std::size_t(PlacementSnapshot const&, RandomSource&)>;

/// The policy of the config key "scheduling": least_committed, least_reported, random or power_of_two.
///
/// Errors: `errc::invalid_argument`, its detail names the four.
result<SchedulingPolicy> scheduling_policy(std::string_view name);

} // namespace webots_cloud
