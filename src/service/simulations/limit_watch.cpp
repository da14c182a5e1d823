#include "limit_watch.hpp"

#include "async/cancellation.hpp"

#include <boost/asio/this_coro.hpp>

#include <functional>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr auto interval = std::chrono::seconds(1);

using Look = std::function<asio::awaitable<void>(SimulationSession&)>;

/// The session after `last`, which may have ended; null: there is none.
std::shared_ptr<SimulationSession> next_session(SimulationSessions const& sessions, std::uint64_t last)
{
    auto const next = sessions.upper_bound(last);
    return next == sessions.end() ? nullptr : next->second;
}

asio::awaitable<void> look_at_processes(SimulationSession& session)
{
    co_await session.usage().look_at_processes();
    session.usage().keep_process_limits();
}

asio::awaitable<result<>> watch(SessionContext& context, SimulationSessions const& sessions, Look look)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        auto const waited = co_await context.clock.wait_until(context.clock.now() + interval);
        bool const cancelled = co_await async::is_cancelled();
        if (!waited || cancelled)
            co_return Failure(asio::error::operation_aborted);
        std::uint64_t last = 0;
        while (auto const session = next_session(sessions, last)) {
            last = session->id();
            co_await look(*session);
            bool const cancelled_meanwhile = co_await async::is_cancelled(); // looks are not cancellable
            if (cancelled_meanwhile)
                co_return Failure(asio::error::operation_aborted);
        }
    }
}

} // namespace

asio::awaitable<result<>> watch_processes(SessionContext& context, SimulationSessions const& sessions)
{
    return watch(context, sessions, look_at_processes);
}

asio::awaitable<result<>> watch_folders(SessionContext& context, SimulationSessions const& sessions,
                                        FolderMeter& meter)
{
    return watch(context, sessions,
                 [&meter](SimulationSession& session) { return session.usage().look_at_folder(meter); });
}

} // namespace webots_cloud
