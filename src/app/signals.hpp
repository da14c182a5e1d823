// Signal handlers of a running server: SIGHUP reloads the configuration, SIGUSR1 drains.
#pragma once

#include "core/config/config_reload.hpp"
#include "core/text.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/servers.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <csignal>
#include <functional>

namespace webots_cloud::app {

template<class Config>
boost::asio::awaitable<result<Configured<Config>>> read_again(Reload<Config> const& reload)
{
    co_return reload();
}

/// Applies `next`. `file` is all that the configuration says by now, which the next start takes: for what
/// looks at that.
template<class Config>
using Apply = std::function<result<>(Config const& next, Config const& file)>;

/// At each SIGHUP, has `reload` read the configuration, on another thread, and passes `apply` the one in
/// force with what the table of keys says may change while the server runs. If it is invalid, or `apply`
/// refuses it, that is logged and the old one stays in use: parts that `apply` has changed by then get the
/// old one again. Ends when cancelled, but not while `reload` reads.
///
/// `in_force` is the configuration of the start at first: a key that needs a restart and differs from its
/// value there is named in the log at each SIGHUP. Without `reload` SIGHUP is left alone.
template<class Config>
boost::asio::awaitable<result<>> obey_sighup(boost::asio::any_io_executor executor, Reload<Config> reload,
                                             Config in_force, Apply<Config> apply, Logger log)
{
    boost::asio::signal_set signals(executor);
    if (reload)
        signals.add(SIGHUP);
    auto file = in_force;
    boost::asio::thread_pool reading(1); // its destructor waits for what it reads
    co_await boost::asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        auto const [error, number] =
            co_await signals.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
        if (error)
            co_return Failure(error);
        // Ten milliseconds for thousands of machines, and any time on a network file system.
        auto const configured =
            co_await boost::asio::co_spawn(reading, read_again(reload), boost::asio::use_awaitable);
        auto const state = co_await boost::asio::this_coro::cancellation_state;
        if (state.cancelled() != boost::asio::cancellation_type::none)
            co_return Failure(boost::asio::error::operation_aborted);
        auto next = in_force;
        auto const changes =
            configured ? core::take_reloaded(next, configured->config) : core::ConfigChanges();
        auto const applied = configured ? apply(next, configured->config) : result<>(configured.error());
        if (!applied) {
            if (configured)
                (void)apply(in_force, file);
            auto const lines = applied.error().message();
            for (auto const line : core::split(lines, '\n'))
                log.error(core::concat("The configuration stays as it was: ", line));
            continue;
        }
        for (auto const& warning : configured->warnings)
            log.warning(warning);
        in_force = std::move(next);
        file = configured->config;
        log.info(changes.applied.empty() ? "The configuration was read again"
                                         : core::concat("The configuration was read again. Applied: ",
                                                        core::join(changes.applied, ", ")));
        if (!changes.waiting.empty())
            log.warning(core::concat("These keys have changed, and take effect at the next start: ",
                                     core::join(changes.waiting, ", ")));
    }
}

/// Calls `drain` at each SIGUSR1. Ends when cancelled.
inline boost::asio::awaitable<result<>> obey_sigusr1(boost::asio::any_io_executor executor,
                                                     std::function<void()> drain)
{
    boost::asio::signal_set signals(executor, SIGUSR1);
    for (;;) {
        auto const [error, number] =
            co_await signals.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
        if (error)
            co_return Failure(error);
        drain();
    }
}

} // namespace webots_cloud::app
