// When a fetch has to stop, and how its parts are told: the wait for the budget, downloads, and work on what
// has arrived.
#pragma once

#include "adapters/http_client/curl_http.hpp"
#include "fetch_budget.hpp"
#include "fetch_interrupt.hpp"

#include "core/refusals.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <boost/asio/error.hpp>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <utility>

namespace webots_cloud::adapters {

/// A fetch stops soon after `aborted` becomes true, and when it has taken longer than `timeout`.
///
/// Thread-safety: any thread, except `restart`.
class FetchDeadline
{
public:
    /// The time begins now. `aborted` may be null.   Lifetime: `aborted` outlives it.
    FetchDeadline(std::atomic<bool> const* aborted, Duration timeout)
        : aborted_(aborted), timeout_(std::min(timeout, longest))
    {
        restart();
    }
    FetchDeadline(FetchDeadline const&) = delete; // what it makes refers to it

    /// The time begins anew: for its turn a fetch waits through no fault of its own.
    void restart() { end_ = std::chrono::steady_clock::now() + timeout_; }

    /// Errors: `operation_aborted`, `timed_out`; the detail is a sentence.
    result<> may_go_on() const
    {
        if (aborted_ && aborted_->load(std::memory_order_relaxed))
            return Failure(boost::asio::error::operation_aborted);
        if (std::chrono::steady_clock::now() > end_)
            return core::refused(core::Refused::fetch_too_slow);
        return {};
    }

    /// Asks `may_go_on`.   Lifetime: it outlives what this returns, as with the next one.
    FetchInterrupt interrupt() const
    {
        return [this] { return may_go_on(); };
    }

    /// For the share of the fetch. `tell`: as in `FetchShare::Waiting`.
    FetchShare::Waiting waiting(std::function<void(bool)> tell) const
    {
        FetchShare::Waiting waiting;
        waiting.interrupt = interrupt();
        waiting.tell = std::move(tell);
        return waiting;
    }

    /// For one download.
    CurlLimits limits(LowSpeed const& low_speed, std::uint64_t bytes) const
    {
        CurlLimits limits;
        limits.aborted = aborted_;
        limits.deadline = end_;
        limits.bytes = bytes;
        limits.low_speed = low_speed;
        return limits;
    }

private:
    static constexpr Duration longest = std::chrono::hours(24); // with more, the sum could overflow

    std::atomic<bool> const* aborted_;
    Duration timeout_;
    TimePoint end_;
};

} // namespace webots_cloud::adapters
