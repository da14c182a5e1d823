#include <webots_cloud/testing/manual_clock.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/experimental/channel.hpp>
#include <boost/asio/use_awaitable.hpp>

namespace webots_cloud::testing {
namespace asio = boost::asio;

struct ManualClock::Waiter
{
    explicit Waiter(asio::any_io_executor const& executor) : due(executor, 1) {}

    asio::experimental::channel<void(boost::system::error_code)> due;
};

ManualClock::ManualClock(asio::any_io_executor executor)
    : executor_(std::move(executor)), now_(std::chrono::hours(1))
{}

ManualClock::~ManualClock() = default;

WallTime ManualClock::wall() const noexcept
{
    using namespace std::chrono;
    constexpr auto start = sys_days(year(2026) / 1 / 1); // a Thursday, midnight UTC
    return start + duration_cast<WallTime::duration>(now_.time_since_epoch());
}

asio::awaitable<result<>> ManualClock::wait_until(TimePoint when)
{
    auto const key = std::pair(when, ++calls_);
    auto const waiter = std::make_shared<Waiter>(executor_);
    waiters_.emplace(key, waiter);
    auto const [error] = co_await waiter->due.async_receive(asio::as_tuple(asio::use_awaitable));
    waiters_.erase(key);
    if (error)
        co_return Failure(asio::error::operation_aborted);
    co_return result<>();
}

bool ManualClock::fire_next(TimePoint limit)
{
    if (waiters_.empty() || waiters_.begin()->first.first > limit)
        return false;
    auto const first = waiters_.begin();
    now_ = std::max(now_, first->first.first);
    first->second->due.try_send(boost::system::error_code());
    waiters_.erase(first);
    return true;
}

} // namespace webots_cloud::testing
