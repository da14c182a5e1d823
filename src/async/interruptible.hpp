// Operations that an owner which stops does not wait for.
#pragma once

#include "deadline.hpp"
#include "first_of.hpp"
#include "wakeup.hpp"

#include <webots_cloud/error.hpp>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/this_coro.hpp>

#include <cstddef>
#include <list>
#include <optional>
#include <utility>

namespace webots_cloud::async {

/// Runs operations, and cancels all of them at once.
///
/// Lifetime: must outlive its operations.   Thread-safety: one executor.
class Interruptible
{
public:
    /// The result of `operation`; `operation_aborted` once they are interrupted, also beforehand.
    template<class T>
    boost::asio::awaitable<result<T>> run(boost::asio::awaitable<result<T>> operation)
    {
        if (is_over_)
            co_return Failure(boost::asio::error::operation_aborted);
        auto const executor = co_await boost::asio::this_coro::executor;
        auto const stop = stops_.emplace(stops_.end(), executor);
        std::optional<result<T>> outcome;
        auto parts = first_of(keep_outcome(std::move(operation), outcome), stop->wait());
        (void)co_await std::move(parts);
        stops_.erase(stop);
        if (!outcome)
            co_return Failure(boost::asio::error::operation_aborted);
        co_return std::move(*outcome);
    }

    /// For good.
    void interrupt()
    {
        is_over_ = true;
        for (auto& stop : stops_)
            stop.notify();
    }

    /// How many run.
    std::size_t size() const noexcept { return stops_.size(); }

private:
    std::list<Wakeup> stops_;
    bool is_over_ = false;
};

} // namespace webots_cloud::async
