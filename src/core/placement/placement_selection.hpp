// The machines that suit one request, where that is not simply all that are offered.
#pragma once

#include "placement_log.hpp"

#include <webots_cloud/scheduler.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace webots_cloud::placement {

/// What one request finds: found by looking at every machine, O(n), unlike the indexes of the Ranking.
class Selection
{
public:
    struct Entry
    {
        std::uint32_t slot = 0;
        std::uint64_t by_score = 0; ///< Keys: the smallest is first.
        std::uint64_t by_load = 0;
        double score = 0;
        bool warm = false;
    };

    /// So that select() allocates nothing.
    void reserve(std::size_t machines)
    {
        if (machines > entries_.capacity())
            entries_.reserve(2 * machines);
    }

    /// Overcommitted machines, those whose memory this session would fill, and, if it must fit, those that
    /// have no room for it, are among them only where there are no others.
    void select(Ranking const& ranking, PlacementRequest const& request, ExpectedCost const& cost) noexcept;
    /// To be called after select(): lowers the scores of machines that have the project.
    void prefer(Ranking const& ranking, std::uint32_t project, ExpectedCost const& cost) noexcept;

    /// To be called after those: where the best machine has reported since then, others have placed nobody
    /// there unseen.
    void believe_reports(Ranking const& ranking, TimePoint since) noexcept;
    /// The best of these machines, this many. Changes the order of entries().
    std::span<Entry const> best(std::size_t count) noexcept;

    std::span<Entry const> entries() const noexcept { return entries_; }
    /// How many machines lack only the labels.
    std::size_t lacking() const noexcept { return lacking_; }
    std::size_t excluded() const noexcept { return excluded_; }
    /// How many lack only room for this session.
    std::size_t too_small() const noexcept { return too_small_; }
    /// Of the sessions that others have probably placed unseen, those that went to these machines.
    double unseen_arrivals() const noexcept { return unseen_arrivals_; }

private:
    void add(Machine const& machine, std::size_t slot, ExpectedCost const& cost) noexcept;

    std::vector<Entry> entries_;
    std::size_t lacking_ = 0;
    std::size_t excluded_ = 0;
    std::size_t too_small_ = 0;
    double unseen_arrivals_ = 0;
};

bool is_excluded(Machine const& machine, PlacementRequest const& request) noexcept;

/// Whether a machine of the list has the labels, or may turn out to have them: it has not reported yet.
bool can_ever_serve(Ranking const& ranking, PlacementRequest const& request) noexcept;

/// The selection as a policy sees it; writes down in `record` what the policy looks at.
class SelectedSnapshot final : public PlacementSnapshot
{
public:
    SelectedSnapshot(Ranking const& ranking, Selection const& selection, Record& record) noexcept
        : ranking_(ranking), selection_(selection), record_(record)
    {}

    std::size_t size() const override { return selection_.entries().size(); }
    Candidate operator[](std::size_t position) const override;
    std::size_t least_committed() const override;
    std::size_t least_reported() const override;
    std::size_t lowest(std::span<std::size_t> positions, std::size_t parts, double where) const override;
    double unseen_arrivals() const override { return selection_.unseen_arrivals(); }

    std::size_t slot(std::size_t position) const noexcept { return selection_.entries()[position].slot; }
    Candidate view(std::size_t position) const noexcept;

private:
    Ranking const& ranking_;
    Selection const& selection_;
    Record& record_;
};

} // namespace webots_cloud::placement
