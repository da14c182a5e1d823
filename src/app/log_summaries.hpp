// Reports periodically how many lines the log's limit has left out.
#pragma once

#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

namespace webots_cloud::app {

/// Runs until it is cancelled.
inline boost::asio::awaitable<result<>> sum_up_log(Logger log, Clock& clock)
{
    constexpr auto interval = std::chrono::seconds(10);
    for (;;) {
        auto const waited = co_await clock.wait_until(clock.now() + interval);
        if (!waited)
            co_return waited;
        log.sum_up();
    }
}

} // namespace webots_cloud::app
