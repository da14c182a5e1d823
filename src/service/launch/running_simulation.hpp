// One simulation that was launched.
#pragma once

#include "core/access/controller_address.hpp"
#include "core/docker/line_budget.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/output_budget.hpp"
#include "core/simulation/port_pool.hpp"
#include "core/simulation/simulator_state.hpp"
#include "core/simulation/webots_output.hpp"
#include "core/slurm/job_output.hpp"
#include "simulator_runtime.hpp"

#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud {

/// Webots that speaks TLS itself is spoken to by browsers themselves.
inline bool uses_gateway(SimulationLauncherConfig const& config, SimulationLauncherFacts const& facts,
                         LaunchSpec const& spec)
{
    return config.gateway && !(spec.old_command_line && facts.old_webots_tls);
}

/// A port of the pool, given back when destroyed.
class PortLease
{
public:
    PortLease(core::PortPool& pool, std::uint16_t port) : pool_(&pool), port_(port) {}
    PortLease(PortLease&& other) noexcept : pool_(std::exchange(other.pool_, nullptr)), port_(other.port_) {}
    PortLease& operator=(PortLease&&) = delete;
    ~PortLease()
    {
        if (pool_)
            pool_->release(port_);
    }
    std::uint16_t port() const noexcept { return port_; }

private:
    core::PortPool* pool_;
    std::uint16_t port_;
};

/// Turns the events of a process into the events of a simulation: `core::SimulatorState` decides.
class RunningSimulation final : public Simulation
{
public:
    RunningSimulation(SimulationLauncherConfig const& config, SimulationLauncherFacts const& facts,
                      PortLease lease, std::unique_ptr<Process> process, ProcessHost& processes, Clock& clock,
                      Logger log, LaunchSpec spec, SimulatorRuntime& runtime, LaunchPlan plan);

    boost::asio::awaitable<result<SimulationEvent>> next_event() override;
    void terminate() noexcept override { stop(Failure(errc::closed)); }
    void terminate_at(Limit limit) noexcept override;
    int process_id() const noexcept override { return process_->id(); }
    TimePoint ends_at() const noexcept override { return state_.ends_at(); }
    void restart_time() noexcept override { state_.restart_life(clock_.now()); }
    Duration extend(Duration asked) noexcept override { return state_.extend(asked); }
    Duration extendable() const noexcept override { return state_.extendable(); }
    std::vector<std::string> const& announcements() const noexcept override { return plan_.announcements; }
    boost::asio::awaitable<result<>> put_back(std::filesystem::path file) override;
    boost::asio::awaitable<Compilation> compile(ControllerSources sources) override;
    boost::asio::awaitable<ProcessUsage> usage() override;

    boost::asio::awaitable<WrittenElsewhere> written_elsewhere() override
    {
        return runtime_.written_elsewhere(plan_);
    }

private:
    TimePoint next_deadline() const;
    bool on_job_line(std::string_view line);
    void on_job_usage(TimePoint now);
    Failure overrun_failure(Limit limit) const;
    void tell_news();
    void tell_progress(std::string news);
    core::SimulatorState::Due on_deadline();
    void on_output(std::string_view bytes);
    void on_line(std::string_view line);
    void on_webots_line(std::string_view line);
    void on_container_end(std::string_view line);
    void on_exit(ExitStatus status, ProcessUsage const& usage);
    void show_progress(std::string_view text);
    void on_heartbeat();
    void note_extern_robot(std::string_view line);
    void note_activity(bool running);
    void note_lines_left_out();
    void note_listening();
    void announce(std::uint16_t port);
    boost::asio::awaitable<void> announce_if_listening();
    boost::asio::awaitable<void> restart_controller();
    void stop(Failure reason) noexcept;

    PortLease lease_;
    std::unique_ptr<Process> process_;
    ProcessHost& processes_;
    Clock& clock_;
    Logger log_;
    std::string label_;
    std::filesystem::path instance_;
    std::filesystem::path simulator_home_; ///< `WEBOTS_HOME` of makefiles.
    std::function<void(std::string_view)> output_;
    SimulatorRuntime& runtime_;
    LaunchPlan plan_;
    core::JobOutput job_;
    ProcessUsage job_usage_;         ///< As the guard on the node has counted it last.
    std::string host_ = "127.0.0.1"; ///< Where the simulator is.
    std::string news_;               ///< The last that the browser was told while the job waits.
    TimePoint next_news_;            ///< When to look for more.
    bool through_gateway_;
    bool names_extern_robots_;
    core::ExternRobots extern_robots_;
    ProcessLimits limits_;
    core::SimulatorState state_;

    core::LineSplitter lines_;
    core::OutputBudget budget_;
    TimePoint read_at_;            ///< When more output may be read.
    TimePoint output_came_;        ///< When the last of it came.
    core::StartWords start_words_; ///< Of what was printed before it was ready.
    std::deque<SimulationEvent> events_;
    core::LineBudget progress_budget_;
    SimulationEnded ended_; ///< Once it has ended.
};

} // namespace webots_cloud
