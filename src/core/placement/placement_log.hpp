// The last decisions with everything that they were based on, in memory that is reserved at the start.
#pragma once

#include "placement_ranking.hpp"

#include <webots_cloud/scheduler.hpp>

namespace webots_cloud::placement {

inline constexpr std::size_t logged_decisions = 100;
inline constexpr std::size_t logged_machines = Ranking::numbered_in_order;

class Selection;

/// A policy and its name in explanations.
struct Policy
{
    std::string name;
    SchedulingPolicy choose;
};

/// A decision being made or kept: fixed in size, so that writing it allocates nothing.
struct Record
{
    std::uint64_t id = 0; ///< Of the decision; 0: not used yet.
    Policy const* policy = nullptr;
    TimePoint at{};
    std::uint64_t random = 0;
    double unseen_arrivals = 0;
    std::size_t offered = 0;
    std::array<std::size_t, refusal_count> refused{};
    std::optional<double> expected_cost;
    std::size_t held = 0;
    std::size_t free_seats = 0;
    std::string_view chosen;
    bool whole_fleet = false;
    bool complete = true;

    struct Entry
    {
        Candidate machine;
        std::size_t position = 0;
    };
    std::array<Entry, logged_machines> entries;
    std::size_t entry_count = 0;

    std::array<std::size_t, PlacementSnapshot::max_lowest> lowest;
    std::size_t lowest_count = 0;
    std::optional<std::size_t> least_committed;
    std::optional<std::size_t> least_reported;

    void begin(Policy const& decides, std::uint64_t seed, TimePoint now, Ranking const& ranking) noexcept;
    /// Only these are offered, as they suit the request: to be called after `begin`.
    void restrict_to(Selection const& selection, PlacementRequest const& request, ExpectedCost const& cost,
                     Ranking const& ranking) noexcept;
    void note(std::size_t position, Candidate const& machine) noexcept;
    Decision decision() const;
};

/// The last decisions. Placing must not allocate, so their memory is reserved at the start: it is used, and
/// counts as the server's, from the first decisions on.
class DecisionLog
{
public:
    DecisionLog() { records_.reserve(logged_decisions); }

    /// The record of the next decision, over that of the oldest one.
    Record& next()
    {
        if (records_.size() != logged_decisions)
            records_.emplace_back();
        Record& record = records_[last_ % logged_decisions];
        record.id = ++last_;
        return record;
    }

    /// Null when it was overwritten, or has not been made.
    Record const* find(std::uint64_t decision) const noexcept
    {
        bool const is_kept = decision != 0 && decision <= last_ && last_ - decision < records_.size();
        return is_kept ? &records_[(decision - 1) % logged_decisions] : nullptr;
    }

    std::vector<Record> const& records() const noexcept { return records_; }

    /// Of the last decision; 0: there was none.
    std::uint64_t last() const noexcept { return last_; }

private:
    std::vector<Record> records_; ///< Decision n is at n - 1, modulo their number.
    std::uint64_t last_ = 0;
};

/// The fleet as a policy sees it; writes down in `record` what the policy looks at.
class LiveSnapshot final : public PlacementSnapshot
{
public:
    LiveSnapshot(Ranking const& ranking, Record& record) noexcept : ranking_(ranking), record_(record) {}

    std::size_t size() const override { return ranking_.offered(); }
    Candidate operator[](std::size_t position) const override;
    std::size_t least_committed() const override;
    std::size_t least_reported() const override;
    std::size_t lowest(std::span<std::size_t> positions, std::size_t parts, double where) const override;
    double unseen_arrivals() const override { return ranking_.unseen_arrivals(); }

    std::size_t slot(std::size_t position) const noexcept { return ranking_.slot_at(position); }
    Candidate const& view(std::size_t position) const noexcept
    {
        return ranking_.machine(slot(position)).view();
    }

private:
    Ranking const& ranking_;
    Record& record_;
};

/// A decision's record as a policy saw the fleet then.
class RecordedSnapshot final : public PlacementSnapshot
{
public:
    explicit RecordedSnapshot(Decision const& decision) noexcept : decision_(decision) {}

    /// The policy asked for something that the record does not hold.
    bool missed() const noexcept { return missed_; }
    Decision::Entry const* find(std::size_t position) const noexcept;

    std::size_t size() const override { return decision_.offered; }
    Candidate operator[](std::size_t position) const override;
    std::size_t least_committed() const override;
    std::size_t least_reported() const override;
    std::size_t lowest(std::span<std::size_t> positions, std::size_t parts, double where) const override;
    double unseen_arrivals() const override { return decision_.unseen_arrivals; }

private:
    Decision const& decision_;
    mutable bool missed_ = false;
};

} // namespace webots_cloud::placement
