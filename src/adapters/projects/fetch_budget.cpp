// Reservations of memory and disk, counted by atomic numbers because threads take them. A fetch that does not
// fit waits until another ends, or is refused when no end could help. The header explains who has what.
#include "fetch_budget.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <cassert>
#include <thread>

namespace webots_cloud {
namespace {

bool take_from(std::atomic<std::uint64_t>& taken, std::uint64_t limit, std::uint64_t more) noexcept
{
    auto before = taken.load(std::memory_order_relaxed);
    do {
        if (more > limit || before > limit - more)
            return more == 0;
    } while (!taken.compare_exchange_weak(before, before + more, std::memory_order_relaxed));
    return true;
}

void give_back_to(std::atomic<std::uint64_t>& taken, std::uint64_t less) noexcept
{
    [[maybe_unused]] auto const before = taken.fetch_sub(less, std::memory_order_relaxed);
    assert(before >= less);
}

} // namespace

bool FetchBudget::take(FetchBytes const& more) noexcept
{
    if (!take_from(memory_, limits_.memory, more.memory))
        return false;
    if (take_from(disk_, limits_.disk, more.disk))
        return true;
    give_back_to(memory_, more.memory);
    return false;
}

void FetchBudget::take_anyway(FetchBytes const& more) noexcept
{
    memory_.fetch_add(more.memory, std::memory_order_relaxed);
    disk_.fetch_add(more.disk, std::memory_order_relaxed);
}

void FetchBudget::give_back(FetchBytes const& less) noexcept
{
    give_back_to(memory_, less.memory);
    give_back_to(disk_, less.disk);
}

std::shared_ptr<FetchBudget> make_fetch_budget(std::uint64_t memory, std::uint64_t disk)
{
    FetchBytes limits;
    limits.memory = memory;
    limits.disk = disk;
    return std::make_shared<FetchBudget>(limits);
}

namespace adapters {

using core::concat;

void FetchGrant::give_back(FetchBytes less) noexcept
{
    assert(less.memory <= held_.memory && less.disk <= held_.disk);
    held_ -= less;
    if (budget_)
        budget_->give_back(less);
}

result<> FetchShare::take(FetchBytes const& more)
{
    auto const before = holds();
    if (!grant_.take(more))
        if (auto const waited = wait_for(more); !waited)
            return waited;
    note_holding(before);
    return {};
}

void FetchShare::give_back(FetchBytes const& less) noexcept
{
    auto const before = holds();
    grant_.give_back(less);
    note_holding(before);
}

void FetchShare::note_holding(bool before) noexcept
{
    auto* const budget = grant_.budget();
    if (!budget || before == holds())
        return;
    budget->holding += before ? -1 : 1;
    if (before && yielding_)
        budget->yielding = yielding_ = false;
}

/// No fetch waits for room that can never become free.
Failure FetchShare::too_large(FetchBytes const& more) const
{
    auto const limits = grant_.budget()->limits();
    auto const is_memory = more.memory > 0 && grant_.held().memory + more.memory > limits.memory;
    auto const max = is_memory ? limits.memory : limits.disk;
    return core::refused(is_memory ? core::Refused::needs_more_memory : core::Refused::needs_more_room,
                         {{"max", std::to_string(max >> 20)}});
}

result<> FetchShare::wait_for(FetchBytes const& more)
{
    struct Waiter // counted while it waits
    {
        Waiter(FetchBudget& of, bool holds, std::function<void(bool)> const& told)
            : budget(of), counts(holds ? 1 : 0), tell(told)
        {
            budget.waiting += counts;
            if (tell)
                tell(true);
        }
        Waiter(Waiter const&) = delete;
        ~Waiter()
        {
            budget.waiting -= counts;
            if (tell)
                tell(false);
        }

        FetchBudget& budget;
        int counts;
        std::function<void(bool)> const& tell;
    };
    constexpr auto pause = std::chrono::milliseconds(20); // from one try to the next

    auto& budget = *grant_.budget();
    auto const limits = budget.limits();
    auto all = grant_.held();
    all += more;
    if ((more.memory > 0 && all.memory > limits.memory) || (more.disk > 0 && all.disk > limits.disk))
        return too_large(more);
    Waiter const waiter(budget, holds(), waiting_.tell);
    auto const end = std::chrono::steady_clock::now() + waiting_.patience;
    while (!grant_.take(more)) {
        if (auto const may_go_on = ask(waiting_.interrupt); !may_go_on)
            return may_go_on;
        // When all who hold something wait, one of them gives up, and the others see what that brings.
        if (holds() && budget.waiting >= budget.holding && !budget.yielding.exchange(true))
            yielding_ = true;
        if (yielding_ || std::chrono::steady_clock::now() > end)
            return core::refused(core::Refused::fetches_wait);
        std::this_thread::sleep_for(pause);
    }
    return {};
}

} // namespace adapters
} // namespace webots_cloud
