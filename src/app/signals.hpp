// Signal handlers of a running server: SIGHUP reloads the configuration, SIGUSR1 drains.
#pragma once

#include "core/config/config_changes.hpp"
#include "core/text.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/servers.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <chrono>
#include <csignal>
#include <functional>

namespace webots_cloud::app {

/// At each SIGHUP, reads the configuration again and passes it to `apply`. If it is invalid, that is logged
/// and the old one stays in use. Ends when cancelled.
///
/// `running` is the configuration of the start: a key that needs a restart and differs from its value there
/// is named in the log at each SIGHUP. Without `reload` SIGHUP is left alone.
template<class Config>
boost::asio::awaitable<result<>> obey_sighup(boost::asio::any_io_executor executor, Reload<Config> reload,
                                             Config const& running,
                                             std::function<result<>(Config const&)> apply, Logger log)
{
    boost::asio::signal_set signals(executor);
    if (reload)
        signals.add(SIGHUP);
    for (;;) {
        auto const [error, number] =
            co_await signals.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
        if (error)
            co_return Failure(error);
        auto const configured = reload();
        // Of thousands of machines both take ten milliseconds and more: others have their turn in between.
        boost::asio::steady_timer pause(executor, std::chrono::milliseconds(1));
        if (auto const [cut] = co_await pause.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
            cut)
            co_return Failure(cut);
        auto const applied = configured ? apply(configured->config) : result<>(configured.error());
        if (!applied) {
            auto const lines = applied.error().message();
            for (auto const line : core::split(lines, '\n'))
                log.error(core::concat("The configuration stays as it was: ", line));
            continue;
        }
        for (auto const& warning : configured->warnings)
            log.warning(warning);
        log.info("The configuration was read again");
        if (auto const keys = core::keys_for_restart(running, configured->config); !keys.empty())
            log.warning(core::concat("These keys have changed, and take effect at the next start: ",
                                     core::join(keys, ", ")));
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
