#include <webots_cloud/simulation_launcher.hpp>

#include "async/deadline.hpp"
#include "core/docker/compose_output.hpp"
#include "core/docker/docker_project.hpp"
#include "core/docker/line_budget.hpp"
#include "core/simulation/last_words.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/output_budget.hpp"
#include "core/simulation/port_pool.hpp"
#include "core/simulation/webots_output.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"
#include "run_program.hpp"
#include "simulator_runtime.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <deque>
#include <optional>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

using core::concat;

// How often a simulator that has loaded its world but does not listen yet is looked at.
constexpr auto listening_check = std::chrono::milliseconds(200);

// Webots tries so many ports above a busy one, without a word.
constexpr int ports_tried_by_webots = 10;

constexpr auto restart_limit = std::chrono::seconds(30);

std::string describe(ExitStatus const& status)
{
    return concat(status.signalled ? "it was ended by signal " : "it exited with status ",
                  std::to_string(status.code));
}

} // namespace

struct SimulationLauncher::Impl
{
    Impl(SimulationLauncherParams parameters, ProcessHost& host, Clock& time, Logger logger,
         DockerMode* containers)
        : params(std::move(parameters)), processes(host), clock(time), log(std::move(logger)),
          runtime(containers ? make_docker_runtime(*containers) : make_native_runtime(params)),
          ports(params.first_port, params.max_simulations)
    {}

    SimulationLauncherParams params;
    ProcessHost& processes;
    Clock& clock;
    Logger log;
    std::unique_ptr<SimulatorRuntime> runtime;
    core::PortPool ports;
};

namespace {

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

/// Turns the events of a process into the events of a simulation.
class RunningSimulation final : public Simulation
{
public:
    RunningSimulation(SimulationLauncherParams const& params, PortLease lease,
                      std::unique_ptr<Process> process, ProcessHost& processes, Clock& clock, Logger log,
                      LaunchSpec spec, SimulatorRuntime& runtime, ContainerPlan plan)
        : lease_(std::move(lease)), process_(std::move(process)), processes_(processes), clock_(clock),
          log_(std::move(log)), label_(std::move(spec.label)), output_(std::move(spec.output)),
          runtime_(runtime), plan_(std::move(plan)), timeout_(params.timeout),
          start_timeout_(params.start_timeout), end_of_life_(clock.now() + params.timeout),
          ready_by_(std::min(clock.now() + params.start_timeout, end_of_life_))
    {
        for (auto& note : plan_.notes)
            events_.emplace_back(SimulationProgress(std::move(note)));
    }

    asio::awaitable<result<SimulationEvent>> next_event() override;
    void terminate() noexcept override { stop({}); }
    int process_id() const noexcept override { return process_->id(); }
    TimePoint ends_at() const noexcept override { return end_of_life_; }
    std::vector<std::string> const& announcements() const noexcept override { return plan_.announcements; }
    asio::awaitable<ProcessUsage> usage() override { return process_->usage(); }

private:
    TimePoint next_deadline() const;
    void on_deadline();
    void on_output(std::string_view bytes);
    void on_line(std::string_view line);
    void on_webots_line(std::string_view line);
    void on_container_end(std::string_view line);
    void on_exit(ExitStatus status);
    void show_progress(std::string_view text);
    void note_activity(bool running);
    void note_lines_left_out();
    void announce(std::uint16_t port);
    asio::awaitable<void> announce_if_listening();
    asio::awaitable<void> restart_controller();
    std::string reason_of_end(std::string_view how, bool expected) const;
    void stop(std::string reason) noexcept;

    PortLease lease_;
    std::unique_ptr<Process> process_;
    ProcessHost& processes_;
    Clock& clock_;
    Logger log_;
    std::string label_;
    std::function<void(std::string_view)> output_;
    SimulatorRuntime& runtime_;
    ContainerPlan plan_;
    Duration timeout_;
    Duration start_timeout_;
    TimePoint end_of_life_;
    TimePoint ready_by_;

    core::LineSplitter lines_;
    core::OutputBudget budget_;
    TimePoint read_at_;          ///< When more output may be read.
    TimePoint output_came_;      ///< The last of it.
    core::LastWords last_words_; ///< Why it ends before it is ready.
    std::string stop_reason_;
    std::deque<SimulationEvent> events_;
    core::LineBudget shown_;
    bool loaded_ = false;
    TimePoint next_look_ = TimePoint::max(); ///< For the port, once the world is loaded.
    std::optional<bool> activity_;           ///< What was said of it before it was ready.
    bool ready_ = false;
    bool stopping_ = false;
    bool restart_wanted_ = false; ///< Of the controller: the simulation was reset.
    std::optional<SimulationEnded> ended_;
};

asio::awaitable<result<SimulationEvent>> RunningSimulation::next_event()
{
    while (events_.empty()) {
        if (ended_)
            co_return SimulationEvent(*ended_);
        if (restart_wanted_ && !stopping_) {
            co_await restart_controller();
            continue;
        }
        // While it is stopping the process host keeps the time: its grace is short, and then it kills.
        auto const deadline = stopping_ ? TimePoint::max() : next_deadline();
        auto const now = clock_.now();
        if (now >= deadline) { // also for one that prints without a pause
            on_deadline();
            if (now >= next_look_ && !ready_ && !stopping_)
                co_await announce_if_listening();
            continue;
        }
        if (now < read_at_) {
            auto const waited = co_await clock_.wait_until(std::min(read_at_, deadline));
            if (!waited)
                co_return waited.error();
            continue;
        }
        auto event = co_await async::with_deadline(clock_, deadline, process_->next_event());
        if (!event && event.error() == errc::timed_out)
            continue;
        if (!event)
            co_return event.error();
        if (auto const* output = std::get_if<ProcessOutput>(&*event)) {
            on_output(output->bytes);
        } else {
            if (runtime_.leaves_something()) { // not to be interrupted: the end is told when nothing is left
                co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
                co_await runtime_.clear(plan_);
            }
            on_exit(std::get<ExitStatus>(*event));
        }
    }
    SimulationEvent const event = std::move(events_.front());
    events_.pop_front();
    co_return event;
}

TimePoint RunningSimulation::next_deadline() const
{
    auto const end = ready_ ? end_of_life_ : std::min(ready_by_, next_look_);
    return std::min(end, budget_.notice_due());
}

void RunningSimulation::on_deadline()
{
    auto const now = clock_.now();
    if (now >= budget_.notice_due())
        note_lines_left_out();
    if (now >= end_of_life_)
        stop(concat("The simulation reached its time limit of ", core::seconds_text(timeout_), " s."));
    else if (ready_ || now < ready_by_)
        return;
    else if (loaded_)
        stop(concat("Webots loaded the world but opened no port within ", core::seconds_text(start_timeout_),
                    " s."));
    else
        stop(concat("Webots did not load the world within ", core::seconds_text(start_timeout_), " s."));
}

void RunningSimulation::on_output(std::string_view bytes)
{
    output_came_ = clock_.now();
    read_at_ = budget_.read(bytes.size(), output_came_);
    auto const each = [this](std::string_view line) { on_line(line); };
    lines_.feed(bytes, each);
}

/// Tells the operator, and a browser that still waits, how much of the output nobody will see.
void RunningSimulation::note_lines_left_out()
{
    auto const notice = budget_.take_notice(clock_.now());
    if (!notice)
        return;
    if (output_)
        output_(concat("[", *notice, "]"));
    log_.warning(LogCause("output", label_), concat("[", label_, "] Of what the simulator prints ", *notice));
    if (!ready_ && !stopping_)
        events_.emplace_back(SimulationProgress(concat("Of what the simulator prints ", *notice)));
}

void RunningSimulation::on_line(std::string_view line)
{
    using enum core::ComposeLine::Source;
    auto const printed = runtime_.read(line, plan_);
    auto const source = printed.line.source;
    if (printed.is_progress)
        show_progress(printed.line.text);
    if (source == webots)
        return on_webots_line(printed.line.text);
    if (budget_.take_line(output_came_)) {
        if (output_)
            output_(line);
        log_.debug(concat("[", label_, "] compose: ", core::printable(line)));
    }
    if (source == webots_end)
        on_container_end(line);
    if (source != compose || ready_)
        return;
    last_words_.hear(line);
    ready_by_ = std::min(clock_.now() + start_timeout_, end_of_life_);
    if (!plan_.image.empty() && core::says_image_is_missing(line, plan_.image))
        stop(core::missing_image_text(plan_.image));
}

/// The simulator has ended, and other containers keep compose running.
void RunningSimulation::on_container_end(std::string_view line)
{
    auto const how = concat("it", core::printable(line.substr(line.rfind(" exited with code ")), 60));
    stop(reason_of_end(how, how == "it exited with code 0"));
}

/// Shows the browser a line while it waits.
void RunningSimulation::show_progress(std::string_view text)
{
    if (ready_ || stopping_ || core::trim(text).empty() || text.starts_with('.') ||
        !shown_.take(clock_.now()))
        return;
    events_.emplace_back(SimulationProgress(core::printable(core::trim(text))));
}

asio::awaitable<void> RunningSimulation::restart_controller()
{
    restart_wanted_ = false;
    auto spec = plan_.restart_controller;
    auto const restarted = co_await run_program(processes_, clock_, std::move(spec), restart_limit);
    if (!restarted && restarted.error().code() != asio::error::operation_aborted)
        log_.error(LogCause("controller", label_),
                   concat("[", label_, "] The controller can't be restarted: ", restarted.error().message()));
}

void RunningSimulation::on_webots_line(std::string_view line)
{
    auto const kind = core::classify_output(line);
    bool const passed_on = kind != core::OutputLine::heartbeat && budget_.take_line(output_came_);
    if (output_ && passed_on)
        output_(line);
    switch (kind) {
    case core::OutputLine::heartbeat:
    case core::OutputLine::open:
        if (ready_ && budget_.take_heartbeat(output_came_))
            events_.emplace_back(SimulationHeartbeat());
        if (!loaded_ && !stopping_) {
            loaded_ = true;
            if (runtime_.keeps_its_port())
                announce(lease_.port());
            else
                next_look_ = output_came_;
        }
        break;
    case core::OutputLine::paused:
        note_activity(false);
        break;
    case core::OutputLine::running:
        note_activity(true);
        break;
    case core::OutputLine::reset:
        restart_wanted_ = !plan_.restart_controller.argv.empty();
        break;
    case core::OutputLine::other:
        if (!ready_)
            last_words_.hear(line);
        if (passed_on)
            log_.debug(concat("[", label_, "] webots: ", core::printable(line)));
    }
}

/// Whoever says it again and again is heard once.
void RunningSimulation::note_activity(bool running)
{
    if (!ready_) {
        activity_ = running;
        return;
    }
    if (!events_.empty() && std::holds_alternative<SimulationActivity>(events_.back()))
        events_.pop_back();
    events_.emplace_back(SimulationActivity(running));
}

void RunningSimulation::announce(std::uint16_t port)
{
    ready_ = true;
    events_.emplace_back(SimulationReady(port));
    if (activity_)
        note_activity(*activity_);
}

asio::awaitable<void> RunningSimulation::announce_if_listening()
{
    auto const assigned = lease_.port();
    auto const highest = static_cast<std::uint16_t>(std::min(assigned + ports_tried_by_webots, 65535));
    auto const port = co_await process_->listening_port(assigned, highest);
    next_look_ = clock_.now() + listening_check;
    if (port == 0 || stopping_)
        co_return;
    if (port != assigned)
        log_.warning(LogCause("port"), concat("[", label_, "] Webots listens on port ", std::to_string(port),
                                              " instead of ", std::to_string(assigned)));
    announce(port);
}

void RunningSimulation::on_exit(ExitStatus status)
{
    lines_.finish([this](std::string_view line) { on_line(line); });
    note_lines_left_out();
    SimulationEnded ended;
    ended.status = status;
    ended.was_ready = ready_;
    ended.reason = stopping_ ? stop_reason_ : reason_of_end(describe(status), status == ExitStatus(0, false));
    ended_ = std::move(ended);
}

std::string RunningSimulation::reason_of_end(std::string_view how, bool expected) const
{
    if (!ready_)
        return concat("Unable to start Webots: ", how, " before the world was loaded",
                      last_words_.text().empty() ? "." : ": " + core::printable(last_words_.text(), 200));
    return expected ? "Webots has quit." : concat("Webots has quit unexpectedly: ", how, ".");
}

void RunningSimulation::stop(std::string reason) noexcept
{
    if (stopping_ || ended_)
        return;
    stopping_ = true;
    stop_reason_ = std::move(reason);
    process_->terminate();
}

} // namespace

SimulationLauncher::SimulationLauncher(SimulationLauncherParams params, ProcessHost& processes, Clock& clock,
                                       Logger log, DockerMode* docker)
    : impl_(std::make_unique<Impl>(std::move(params), processes, clock, std::move(log), docker))
{}

SimulationLauncher::~SimulationLauncher() = default;

asio::awaitable<result<std::unique_ptr<Simulation>>> SimulationLauncher::launch(LaunchSpec spec)
{
    if (!core::is_known_mode(spec.mode))
        co_return Failure(errc::invalid_argument,
                          concat("Unsupported client mode: ", core::printable(spec.mode, 40),
                                 ". Expected w3d, x3d or mjpeg."));
    std::unique_ptr<PortHold> hold;
    auto const take = [&](std::uint16_t port) {
        auto taken = impl_->processes.hold_port(port);
        if (!taken) {
            impl_->log.info(LogCause("port in use"),
                            concat("Port ", std::to_string(port), " is already in use."));
            return false;
        }
        hold = std::move(*taken);
        return true;
    };
    auto const port = impl_->ports.acquire(take);
    if (!port)
        co_return port.error();
    PortLease lease(impl_->ports, *port);

    auto plan = co_await impl_->runtime->plan(spec, *port);
    if (!plan)
        co_return plan.error();
    std::string command;
    for (auto const& argument : plan->process.argv)
        command.append(command.empty() ? "" : " ").append(argument);

    hold.reset(); // as late as possible: from now on the port is the simulator's to take
    auto process = plan->process;
    auto started = co_await impl_->processes.start(std::move(process));
    if (!started) {
        impl_->runtime->forget(*plan);
        co_return Failure(started.error().code(),
                          concat("Unable to start Webots: ", started.error().message()));
    }
    impl_->log.info(LogCause("launch"),
                    concat("[", spec.label, "] Webots [", std::to_string((*started)->id()), "] started: \"",
                           core::printable(command, 1024), "\""));
    co_return std::make_unique<RunningSimulation>(impl_->params, std::move(lease), std::move(*started),
                                                  impl_->processes, impl_->clock, impl_->log, std::move(spec),
                                                  *impl_->runtime, std::move(*plan));
}

std::size_t SimulationLauncher::running() const noexcept
{
    return impl_->ports.lent();
}

SimulationLauncherParams const& SimulationLauncher::params() const noexcept
{
    return impl_->params;
}

} // namespace webots_cloud
