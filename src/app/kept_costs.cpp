#include "kept_costs.hpp"

#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

namespace webots_cloud::app {

namespace asio = boost::asio;

void load_costs(Scheduler& scheduler, adapters::KeptFile const& file, Clock const& clock, Logger const& log)
{
    auto const text = file.read();
    if (!text && text.error() == errc::not_found)
        return; // a first start
    if (!text)
        log.warning(core::concat("What worlds cost is learned anew: ", text.error().message()));
    else if (auto const loaded = scheduler.load_costs(*text, clock.now()); !loaded)
        log.warning(core::concat("What worlds cost is learned anew: ", loaded.error().message()));
}

asio::awaitable<result<>> keep_costs(Scheduler& scheduler, adapters::KeptFile& file, Clock& clock, Logger log)
{
    constexpr auto interval = std::chrono::minutes(10);
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        auto const waited = co_await clock.wait_until(clock.now() + interval);
        // At the end of the server, too, what was learned is stored: the next one begins with it.
        if (!waited)
            co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
        auto text = scheduler.save_costs(clock.now());
        auto const written = co_await file.replace(std::move(text));
        if (!written)
            log.warning(LogCause("costs"),
                        core::concat("What worlds cost can't be stored: ", written.error().message()));
        if (!waited)
            co_return waited;
    }
}

} // namespace webots_cloud::app
