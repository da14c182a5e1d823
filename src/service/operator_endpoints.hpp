// What operators, their tools and session servers ask a simulation server, and the measuring behind the
// answers.
#pragma once

#include "async/wakeup.hpp"
#include "core/load/load_formula.hpp"
#include "core/pages/shared_page.hpp"
#include "core/pages/simulation_board.hpp"
#include "monitor_feed.hpp"
#include "route_table.hpp"
#include "simulation_session.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/simulation_service.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace webots_cloud {

/// The sessions of a server, by their number. Shared with the conversations that have them or want them.
using SimulationSessions = std::map<std::uint64_t, std::shared_ptr<SimulationSession>>;

/// `/load`, `/monitor`, `/metrics`, `/livez`, `/readyz` and `/api/drain`.
///
/// Lifetime: everything passed by reference must outlive it.   Thread-safety: one executor.
class OperatorEndpoints
{
public:
    OperatorEndpoints(SimulationServiceParams const& params, SessionContext& context,
                      SimulationSessions const& sessions, HostMetrics& metrics);

    /// Looks at the machine; `due` is when that was to happen, `clients` the browsers on /client.
    void measure(TimePoint due, std::size_t clients);

    /// Looks at what simulators consume while somebody wants to know it, and tells who watches.   Ends only
    /// when cancelled: `operation_aborted`.
    boost::asio::awaitable<result<>> look_at_processes();

    /// What the configuration says has changed: pages are made anew.
    void refresh_pages();

    /// True when the path of a request is one of ours.
    static bool serves(std::string_view path) noexcept;
    Answer answer(IncomingRequest const& request);

    /// Keeps a browser that watches /monitor informed until it leaves.
    boost::asio::awaitable<void> watch(Channel& channel);

    void drain(bool exit_when_empty);

    /// Drained, and asked to end with the last simulation.
    bool has_finished() const noexcept { return exit_when_empty_ && sessions_.empty(); }

    double load() const noexcept { return average_.value(); }

private:
    boost::asio::awaitable<void> look_at_some();
    void want_look();
    std::size_t running() const;
    std::vector<core::SimulationRow> rows() const;
    std::size_t capacity() const;
    LoadReport report() const;
    std::string monitor_snapshot();
    std::string monitor_text() const;

    static std::span<Route<OperatorEndpoints> const> routes();
    bool is_operators(IncomingRequest const& request) const { return request.is_operator; }
    Answer load_answer(IncomingRequest const& request);
    Answer monitor_page(IncomingRequest const& request);
    Answer figures(IncomingRequest const& request);
    Answer liveness(IncomingRequest const& request);
    Answer readiness(IncomingRequest const& request);
    Answer drain_answer(IncomingRequest const& request);

    SimulationServiceParams const& params_;
    SessionContext& context_;
    SimulationSessions const& sessions_;
    HostMetrics& metrics_;

    HostDescription description_;
    HostSample last_sample_;
    TimePoint measured_;
    core::MovingAverage average_;
    Duration event_loop_lag_{}; ///< How late the last measurement was.
    /// The same of the last minute, a second each, so that a scrape misses no pause.
    std::array<Duration, 60> event_loop_lags_{};
    std::size_t measurements_ = 0;

    core::SimulationBoard board_;
    MonitorFeed feed_; ///< To those that watch the monitor page.
    core::TimedPage monitor_html_;
    core::TimedPage monitor_json_;
    std::string greeting_; ///< Of who comes to watch before the next measurement; empty: nobody has come yet.
    std::optional<async::Wakeup> look_wanted_; ///< There while `look_at_processes` is.
    bool update_due_ = false;                  ///< To who watches, after that look.
    TimePoint looked_at_processes_;
    std::uint64_t last_looked_at_ = 0; ///< The session whose processes were looked at last: they take turns.
    bool exit_when_empty_ = false;
};

} // namespace webots_cloud
