// A clock that stands still until a test moves it.
#pragma once

#include <webots_cloud/transport/clock.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <cstddef>
#include <map>
#include <memory>
#include <utility>

namespace webots_cloud::testing {

/// Virtual time. Starts at a fixed moment; waiters complete in order of due time, then of their calls.
class ManualClock final : public Clock
{
public:
    explicit ManualClock(boost::asio::any_io_executor executor);
    ~ManualClock() override;

    TimePoint now() const noexcept override { return now_; }
    WallTime wall() const noexcept override;
    boost::asio::awaitable<result<>> wait_until(TimePoint when) override;

    /// Moves to the earliest waiter that is due at `limit` or before and completes it; false when there is
    /// none.
    bool fire_next(TimePoint limit = TimePoint::max());

    /// Moves to `when`, which is not before now. Does not complete waiters: see `World::advance`.
    void move_to(TimePoint when) { now_ = when; }

    /// How many calls wait.
    std::size_t pending() const noexcept { return waiters_.size(); }

private:
    struct Waiter;

    boost::asio::any_io_executor executor_;
    TimePoint now_;
    std::size_t calls_ = 0;
    std::map<std::pair<TimePoint, std::size_t>, std::shared_ptr<Waiter>> waiters_;
};

} // namespace webots_cloud::testing
