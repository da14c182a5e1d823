// What a simulation server tells about itself to everybody, session servers and its operator: pages, figures
// and the measurements that they show; and the requests by which the operator drains it and ends simulations.
#pragma once

#include "async/wakeup.hpp"
#include "core/access/view_keys.hpp"
#include "core/load/load_formula.hpp"
#include "core/pages/metrics_text.hpp"
#include "core/pages/shared_page.hpp"
#include "core/pages/simulation_board.hpp"
#include "service/monitor_feed.hpp"
#include "service/route_table.hpp"
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

/// `/load`, `/monitor`, `/metrics`, `/livez`, `/readyz`, `/api/operator`, `/api/drain` and `/api/end`.
///
/// Lifetime: everything passed by reference must outlive it.
/// Thread-safety: one executor.
class StatusEndpoints
{
public:
    StatusEndpoints(SessionContext& context, SimulationSessions const& sessions, HostMetrics& metrics);

    /// Measures the load of the machine. `due`: when that was scheduled; `clients`: the number of browsers on
    /// /client.
    void measure(TimePoint due, std::size_t clients);

    /// Measures what simulators consume while somebody watches, and sends updates to those who do.
    ///
    /// Errors: `operation_aborted`; it ends only when cancelled.
    boost::asio::awaitable<result<>> look_at_processes();

    /// To be called when parameters have changed: pages are rendered again.
    void refresh_pages();

    /// Whether `answer` knows the path.
    static bool serves(std::string_view path) noexcept;
    Answer answer(IncomingRequest const& request);

    /// Sends updates to a browser that watches /monitor until it leaves.
    boost::asio::awaitable<void> watch(Channel& channel);

    void drain(bool exit_when_empty);

    /// Drained, and asked to end with the last simulation.
    bool has_finished() const noexcept { return context_.state.has_finished(sessions_.size()); }

    double load() const noexcept { return average_.value(); }

    /// Whether somebody who comes now gets a simulation, as far as places are concerned.
    bool takes_simulations() const;

private:
    boost::asio::awaitable<void> look_at_some();
    void want_look();
    void expire_old_pages();
    template<class Predicate>
    std::size_t count(Predicate is_counted) const;
    std::size_t running() const;
    std::size_t fetches() const;
    std::size_t staged() const;
    double cpu_of_browsers(double all) const;
    double memory_of_browsers() const;
    std::vector<core::SimulationRow> rows() const;
    std::size_t capacity() const;
    std::vector<core::MachineFigure> machine() const;
    LoadReport report() const;
    std::vector<WorldUse> worlds() const;
    std::string monitor_snapshot();
    std::string monitor_text();
    void describe_machine();

    static std::span<Route<StatusEndpoints> const> routes();
    bool is_operators(IncomingRequest const& request) const { return request.is_operator; }
    Answer load_answer(IncomingRequest const& request);
    Answer monitor_page(IncomingRequest const& request);
    Answer watch_by_key(IncomingRequest const& request);
    void write_consumption(core::MetricsText& text) const;
    void write_traffic(core::MetricsText& text) const;
    Answer metrics_answer(IncomingRequest const& request);
    Answer liveness(IncomingRequest const& request);
    Answer readiness(IncomingRequest const& request);
    Answer drain_answer(IncomingRequest const& request);
    Answer end_answer(IncomingRequest const& request);
    Answer operator_answer(IncomingRequest const& request);

    SessionContext& context_;
    SimulationSessions const& sessions_;
    HostMetrics& metrics_;

    HostDescription description_;
    HostSample last_sample_;
    TimePoint measured_;
    core::MovingAverage average_;
    Duration event_loop_lag_{}; ///< How late the last measurement was.
    /// Those of the last 60 measurements, so that a scrape once a minute misses none.
    std::array<Duration, 60> event_loop_lags_{};
    std::size_t measurements_ = 0;

    core::SimulationBoard board_;
    MonitorFeed feed_;         ///< To the browsers that watch the monitor page.
    core::ViewKeys view_keys_; ///< Of pages that session servers pass on.
    core::TimedPage monitor_html_;
    core::TimedPage monitor_json_;
    std::uint64_t shown_changes_ = 0; ///< Those of the context when the pages were made.
    std::string greeting_; ///< The first text for browsers that connect before the next measurement; empty:
                           ///< not made yet.
    std::optional<async::Wakeup> look_wanted_; ///< Set while `look_at_processes` runs.
    bool update_due_ = false;                  ///< To be sent after the next measurement of simulators.
    TimePoint looked_at_processes_;
    std::uint64_t last_looked_at_ = 0; ///< The session whose processes were measured last: they take turns.
};

} // namespace webots_cloud
