// Limits the memory and disk that all fetches of projects together may use: git, websites and their archives.
//
// FetchBudget: one for a server, made by src/app. FetchGrant: what one owner has of it: a FetchShare, the
// cache's indices. FetchShare: what one fetch has; it waits for room. Loan: a step of a fetch that gives back
// at its end what it took. Plain folders take no part: their copies need no memory, and their disk is counted
// by `FetchLimits` alone.
#pragma once

#include "fetch_interrupt.hpp"

#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

namespace webots_cloud {

/// An amount of both.
struct FetchBytes
{
    std::uint64_t memory = 0;
    std::uint64_t disk = 0;

    FetchBytes& operator+=(FetchBytes const& more) noexcept
    {
        memory += more.memory;
        disk += more.disk;
        return *this;
    }
    FetchBytes& operator-=(FetchBytes const& less) noexcept
    {
        memory -= less.memory;
        disk -= less.disk;
        return *this;
    }
};

/// Counts how much is taken, never more than the limits except by `take_anyway`.
///
/// Lock-free, so that the event loop never blocks when it gives memory back; fetches that wait for room
/// retry. Thread-safety: any thread.
class FetchBudget
{
public:
    explicit FetchBudget(FetchBytes limits) noexcept : limits_(limits) {}

    /// All of it or, when there is no room for it, nothing.
    bool take(FetchBytes const& more) noexcept;

    /// For memory that is in use already and has to be counted.
    void take_anyway(FetchBytes const& more) noexcept;

    void give_back(FetchBytes const& less) noexcept;

    FetchBytes limits() const noexcept { return limits_; }
    FetchBytes taken() const noexcept { return {memory_.load(), disk_.load()}; }

    /// Fetches that hold something, and those of them that wait for more: when all do, it is a
    /// deadlock.
    std::atomic<int> holding{0};
    std::atomic<int> waiting{0};
    std::atomic<bool> yielding{false}; ///< One has given up, and is about to give back.

private:
    FetchBytes limits_;
    std::atomic<std::uint64_t> memory_{0};
    std::atomic<std::uint64_t> disk_{0};
};

namespace adapters {

/// What a file takes of a disk: whole blocks.
constexpr std::uint64_t bytes_on_disk(std::uint64_t size) noexcept
{
    constexpr std::uint64_t block = 4096;
    return size <= block ? block : (size + block - 1) / block * block;
}

/// A part of the budget, given back when it is destroyed.   Thread-safety: one thread at a time.
class FetchGrant
{
public:
    FetchGrant() = default;
    /// `budget` may be null: then everything is granted.
    explicit FetchGrant(std::shared_ptr<FetchBudget> budget) : budget_(std::move(budget)) {}
    FetchGrant(FetchGrant&& other) noexcept
        : budget_(std::move(other.budget_)), held_(std::exchange(other.held_, FetchBytes()))
    {}
    FetchGrant& operator=(FetchGrant&& other) noexcept
    {
        std::swap(budget_, other.budget_);
        std::swap(held_, other.held_);
        return *this;
    }
    ~FetchGrant() { give_back(held_); }

    bool take(FetchBytes const& more) noexcept
    {
        if (budget_ && !budget_->take(more))
            return false;
        held_ += more;
        return true;
    }

    void take_anyway(FetchBytes const& more) noexcept
    {
        if (budget_)
            budget_->take_anyway(more);
        held_ += more;
    }

    /// Precondition: so much is held.
    void give_back(FetchBytes less) noexcept; // a copy: it may be all that is held

    FetchBytes held() const noexcept { return held_; }
    FetchBudget* budget() const noexcept { return budget_.get(); }

private:
    std::shared_ptr<FetchBudget> budget_;
    FetchBytes held_;
};

/// What one fetch holds. It may wait for others to give back.   Thread-safety: one thread at a time.
class FetchShare
{
public:
    /// How it waits for room.
    struct Waiting
    {
        FetchInterrupt interrupt;       ///< Ends the wait, too.
        std::function<void(bool)> tell; ///< Called with true when it begins to wait.
        Duration patience = std::chrono::seconds(20);
    };

    FetchShare(std::shared_ptr<FetchBudget> budget, Waiting waiting)
        : grant_(std::move(budget)), waiting_(std::move(waiting))
    {}
    FetchShare(FetchShare const&) = delete;
    ~FetchShare() { give_back(grant_.held()); }

    /// Waits for room, if need be. Blocks.
    ///
    /// Errors: `too_large`: there never will be; `unavailable`: others have had it for too long; the
    /// interrupt's. The detail is a sentence.
    result<> take(FetchBytes const& more);

    /// Precondition: so much is held.
    void give_back(FetchBytes const& less) noexcept;

    FetchBytes held() const noexcept { return grant_.held(); }

    /// Gives back, when it is destroyed, what was taken since it was made.
    class Loan
    {
    public:
        explicit Loan(FetchShare& share) : share_(share), before_(share.held()) {}
        Loan(Loan const&) = delete;
        ~Loan()
        {
            auto since = share_.held();
            since -= before_;
            share_.give_back(since);
        }

    private:
        FetchShare& share_;
        FetchBytes before_;
    };

private:
    result<> wait_for(FetchBytes const& more);
    Failure too_large(FetchBytes const& more) const;
    void note_holding(bool before) noexcept;
    bool holds() const noexcept { return grant_.held().memory > 0 || grant_.held().disk > 0; }

    FetchGrant grant_;
    Waiting waiting_;
    bool yielding_ = false;
};

} // namespace adapters
} // namespace webots_cloud
