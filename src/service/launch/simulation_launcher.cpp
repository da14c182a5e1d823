// Starts simulators on ports of a pool and turns what they print and do into events. What differs between
// programs, containers and jobs is behind SimulatorRuntime.
// Decisions: core/simulation/simulator_state, core/simulation/webots_output, core/simulation/port_pool.
#include <webots_cloud/simulation_launcher.hpp>

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "core/access/controller_address.hpp"
#include "core/docker/compose_output.hpp"
#include "core/docker/docker_project.hpp"
#include "core/docker/line_budget.hpp"
#include "core/refusals.hpp"
#include "core/sandbox/limits.hpp"
#include "core/simulation/controller_compiler.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/output_budget.hpp"
#include "core/simulation/port_pool.hpp"
#include "core/simulation/private_display.hpp"
#include "core/simulation/simulator_state.hpp"
#include "core/simulation/webots_output.hpp"
#include "core/slurm/job_output.hpp"
#include "core/text.hpp"
#include "run_compiler.hpp"
#include "service/run_program.hpp"
#include "simulator_runtime.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <deque>
#include <optional>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

using core::concat;
using State = core::SimulatorState::State;

// Of a container with a controller, and of a file that is copied to a node.
constexpr auto restart_limit = std::chrono::seconds(30);

// How often somebody who waits for a job is told what is new.
constexpr auto news_interval = std::chrono::seconds(1);

/// Webots that speaks TLS itself is spoken to by browsers themselves.
bool uses_gateway(SimulationLauncherParams const& params, LaunchSpec const& spec)
{
    return params.config.gateway && !(spec.old_command_line && params.old_webots_tls);
}

asio::awaitable<ProcessUsage> known_usage(ProcessUsage usage)
{
    co_return usage;
}

std::string describe(ExitStatus const& status)
{
    return concat(status.signalled ? "it was ended by signal " : "it exited with status ",
                  std::to_string(status.code));
}

} // namespace

namespace {

std::unique_ptr<SimulatorRuntime> make_runtime(SimulationLauncherParams const& params, DockerMode* docker,
                                               SlurmMode* slurm)
{
    if (docker)
        return make_docker_runtime(*docker);
    return slurm ? make_slurm_runtime(params, *slurm) : make_native_runtime(params);
}

} // namespace

struct SimulationLauncher::Impl
{
    Impl(SimulationLauncherParams parameters, ProcessHost& host, Clock& time, Logger logger,
         DockerMode* docker, SlurmMode* slurm)
        : params(std::move(parameters)), processes(host), clock(time), log(std::move(logger)),
          runtime(make_runtime(params, docker, slurm)),
          ports(params.first_port, params.config.max_simulations)
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

/// Turns the events of a process into the events of a simulation: `core::SimulatorState` decides.
class RunningSimulation final : public Simulation
{
public:
    RunningSimulation(SimulationLauncherParams const& params, PortLease lease,
                      std::unique_ptr<Process> process, ProcessHost& processes, Clock& clock, Logger log,
                      LaunchSpec spec, SimulatorRuntime& runtime, LaunchPlan plan)
        : lease_(std::move(lease)), process_(std::move(process)), processes_(processes), clock_(clock),
          log_(std::move(log)), label_(std::move(spec.label)), instance_(std::move(spec.instance)),
          simulator_home_(params.compiler.home), output_(std::move(spec.output)), runtime_(runtime),
          plan_(std::move(plan)), through_gateway_(uses_gateway(params, spec)),
          names_extern_robots_(spec.names_extern_robots), limits_(params.limits),
          state_(clock.now(), params.config.start_timeout, params.config.timeout, params.config.extendable)
    {
        if (!plan_.job.empty())
            limits_.memory = plan_.job_memory;
        for (auto& note : plan_.notes)
            events_.emplace_back(SimulationProgress(std::move(note)));
        if (process_->listening() != Listening::unknown)
            state_.is_told_of_port();
    }

    asio::awaitable<result<SimulationEvent>> next_event() override;
    void terminate() noexcept override { stop(Failure(errc::closed)); }
    void terminate_at(Limit limit) noexcept override;
    int process_id() const noexcept override { return process_->id(); }
    TimePoint ends_at() const noexcept override { return state_.ends_at(); }
    void restart_time() noexcept override { state_.restart_life(clock_.now()); }
    Duration extend(Duration asked) noexcept override { return state_.extend(asked); }
    Duration extendable() const noexcept override { return state_.extendable(); }
    std::vector<std::string> const& announcements() const noexcept override { return plan_.announcements; }
    asio::awaitable<result<>> put_back(std::filesystem::path file) override;
    asio::awaitable<Compilation> compile(ControllerSources sources) override;
    asio::awaitable<ProcessUsage> usage() override
    {
        return plan_.job.empty() ? process_->usage() : known_usage(job_usage_);
    }

    asio::awaitable<WrittenElsewhere> written_elsewhere() override
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
    asio::awaitable<void> announce_if_listening();
    asio::awaitable<void> restart_controller();
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

asio::awaitable<result<SimulationEvent>> RunningSimulation::next_event()
{
    while (events_.empty()) {
        if (state_.state() == State::ended)
            co_return SimulationEvent(ended_);
        if (state_.take_restart()) {
            co_await restart_controller();
            continue;
        }
        // What happens without a word of the simulator comes first: it may print without a pause.
        tell_news();
        note_listening();
        if (!events_.empty())
            break;
        auto const deadline = next_deadline();
        auto const now = clock_.now();
        if (now >= deadline) { // also for a simulator that prints without a pause
            auto const due = on_deadline();
            if (due == core::SimulatorState::Due::look_for_port)
                co_await announce_if_listening();
            continue;
        }
        // It has printed more than it may: what is left stays in the pipe for a while, so that it has to
        // wait, and not we.
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
        } else if (std::holds_alternative<ExitStatus>(*event)) {
            if (runtime_.leaves_something()) // not cancellable: the end is reported when nothing is left
                co_await async::uncancellable(runtime_.clear(plan_));
            auto const usage = co_await process_->usage();
            on_exit(std::get<ExitStatus>(*event), usage);
        }
    }
    SimulationEvent const event = std::move(events_.front());
    events_.pop_front();
    co_return event;
}

TimePoint RunningSimulation::next_deadline() const
{
    // While it stops, the process host keeps the time: it kills after a short grace.
    if (state_.state() == State::stopping)
        return TimePoint::max();
    auto const news_due = state_.is_waiting() ? next_news_ : TimePoint::max();
    return std::min({state_.deadline(), budget_.notice_due(), news_due});
}

/// Tells the browser what Slurm says of its job while it waits.
void RunningSimulation::tell_news()
{
    auto const now = clock_.now();
    if (!state_.is_waiting() || now < next_news_)
        return;
    next_news_ = now + news_interval;
    tell_progress(runtime_.news_of(plan_));
}

/// Tells the browser how its job gets on, if that is something new.
void RunningSimulation::tell_progress(std::string news)
{
    if (news.empty() || news == news_ || !state_.is_starting())
        return;
    news_ = news;
    events_.emplace_back(SimulationProgress(std::move(news)));
}

/// What the simulator uses on its node, where the guard only counts: we keep the limits.
void RunningSimulation::on_job_usage(TimePoint now)
{
    auto const& counted = job_.usage();
    job_usage_ = ProcessUsage(counted.processor, counted.memory);
    job_usage_.own_memory_bytes = counted.own_memory;
    job_usage_.processes = counted.processes;
    job_usage_.complete = counted.complete;
    job_usage_.counted = now;
    core::Consumption used;
    used.memory = counted.own_memory;
    used.processes = counted.processes;
    used.disk = counted.disk;
    used.too_many_files = counted.too_many_files;
    if (auto const limit = core::overrun(limits_, used))
        terminate_at(*limit);
}

asio::awaitable<result<>> RunningSimulation::put_back(std::filesystem::path file)
{
    auto const copied = co_await runtime_.put_into_containers(plan_, file);
    if (!copied)
        co_return core::refused(core::Refused::not_put_back, {{"words", copied.error().message()}});
    if (job_.number().empty()) // there is no copy yet; it will have the file as it is
        co_return result<>();
    auto spec = runtime_.put_back(plan_, job_.number(), file);
    if (spec.argv.empty())
        co_return result<>();
    auto const done = co_await run_program(processes_, clock_, std::move(spec), restart_limit);
    if (!done)
        co_return core::refused(core::Refused::not_put_back, {{"words", done.error().message()}});
    co_return result<>();
}

asio::awaitable<Compilation> RunningSimulation::compile(ControllerSources sources)
{
    auto spec = runtime_.compiler(plan_, instance_, sources);
    if (spec.argv.empty()) {
        Compilation compilation;
        compilation.outcome = core::refused(core::Refused::no_compiler, {{"controller", sources.name}});
        co_return compilation;
    }
    auto compilation = co_await run_compiler(processes_, clock_, std::move(spec), std::move(sources.name));
    compilation.output = core::without_home(std::move(compilation.output), simulator_home_);
    co_return compilation;
}

Failure RunningSimulation::overrun_failure(Limit limit) const
{
    return core::overrun_failure(limit, limits_, !plan_.job.empty());
}

/// A line of a job.   Returns: whether it is the simulator's.
bool RunningSimulation::on_job_line(std::string_view line)
{
    using enum core::JobOutput::Line;
    auto const kind = job_.read(line);
    if (kind == simulators)
        return true;
    auto const now = clock_.now();
    // These come again and again, and would fill the log.
    if (kind == uses) {
        on_job_usage(now);
        return false;
    }
    if (kind == receives) {
        tell_progress(core::copying_text(job_.usage().received));
        return false;
    }
    if (budget_.take_line(now)) // a simulator can print such lines
        log_.info(LogCause("job", label_), concat("[", label_, "] ", core::printable(line, 300)));
    if (kind == waits)
        state_.waits();
    else if (kind == runs && state_.begins(now))
        events_.emplace_back(SimulationAllocated());
    else if (kind == ends)
        stop(job_.reason());
    return false;
}

core::SimulatorState::Due RunningSimulation::on_deadline()
{
    using Due = core::SimulatorState::Due;
    auto const now = clock_.now();
    if (now >= budget_.notice_due())
        note_lines_left_out();
    auto const due = state_.due(now);
    if (due != Due::nothing && due != Due::look_for_port)
        stop(state_.stop_reason(due));
    return due;
}

void RunningSimulation::on_output(std::string_view bytes)
{
    output_came_ = clock_.now();
    read_at_ = budget_.read(bytes.size(), output_came_);
    auto const each = [this](std::string_view line) { on_line(line); };
    lines_.feed(bytes, each);
}

/// Tells the operator, and a browser that still waits, how many lines were left out.
void RunningSimulation::note_lines_left_out()
{
    auto const notice = budget_.take_notice(clock_.now());
    if (!notice)
        return;
    if (output_)
        output_(concat("[", *notice, "]"));
    log_.warning(LogCause("output", label_), concat("[", label_, "] Of what the simulator prints ", *notice));
    if (state_.is_starting())
        events_.emplace_back(SimulationProgress(concat("Of what the simulator prints ", *notice)));
}

void RunningSimulation::on_line(std::string_view line)
{
    using enum core::ComposeLine::Source;
    if (!plan_.job.empty() && !on_job_line(line))
        return;
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
    // What follows is about compose's own words during a start. As long as it says something, as during a
    // build, the start gets more time.
    if (source != compose || state_.was_ready())
        return;
    start_words_.of_compose(core::without_project(line, plan_.project)); // it may say why nothing starts
    state_.start_goes_on(clock_.now());
    if (!plan_.image.empty() && core::says_image_is_missing(line, plan_.image))
        stop(core::missing_image(plan_.image));
}

/// The simulator has ended, and other containers keep compose running.
void RunningSimulation::on_container_end(std::string_view line)
{
    auto const how = concat("it", core::printable(line.substr(line.rfind(" exited with code ")), 60));
    stop(state_.end_reason(how, how == "it exited with code 0", start_words_.text()));
}

/// Shows the browser a line while it waits.
void RunningSimulation::show_progress(std::string_view text)
{
    if (!state_.is_starting() || core::trim(text).empty() || text.starts_with('.') ||
        !progress_budget_.take(clock_.now()))
        return;
    auto const told = core::without_project(core::trim(text), plan_.project);
    events_.emplace_back(SimulationProgress(core::printable(told)));
}

asio::awaitable<void> RunningSimulation::restart_controller()
{
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
        on_heartbeat();
        break;
    case core::OutputLine::paused:
        note_activity(false);
        break;
    case core::OutputLine::running:
        note_activity(true);
        break;
    case core::OutputLine::reset:
        // In a competition the controller runs in a container of its own, which Webots can't start again.
        if (!plan_.restart_controller.argv.empty())
            state_.reset();
        break;
    case core::OutputLine::display_ended:
        log_.warning(LogCause("display", label_), concat("[", label_, "] ", core::printable(line, 300)));
        stop(core::refused(core::Refused::display_ended));
        break;
    case core::OutputLine::other:
        note_extern_robot(line);
        if (!state_.was_ready())
            start_words_.of_simulator(line);
        if (passed_on)
            log_.debug(concat("[", label_, "] webots: ", core::printable(line)));
    }
}

/// Whoever prints such a line: the author of the project is told, nobody else.
void RunningSimulation::note_extern_robot(std::string_view line)
{
    auto robot = names_extern_robots_ ? core::extern_robot_in(line) : std::nullopt;
    if (robot && extern_robots_.add(*robot))
        events_.emplace_back(SimulationExternRobot(std::move(*robot)));
}

void RunningSimulation::on_heartbeat()
{
    using Heartbeat = core::SimulatorState::Heartbeat;
    auto const heartbeat = state_.heartbeat(output_came_);
    if (heartbeat == Heartbeat::pass_on && budget_.take_heartbeat(output_came_))
        events_.emplace_back(SimulationHeartbeat());
    if (heartbeat == Heartbeat::world_is_loaded && runtime_.keeps_its_port() && state_.port_opened())
        announce(lease_.port());
}

/// Only the last of several changes in a row is reported.
void RunningSimulation::note_activity(bool running)
{
    if (!state_.activity(running))
        return;
    if (!events_.empty() && std::holds_alternative<SimulationActivity>(events_.back()))
        events_.pop_back();
    events_.emplace_back(SimulationActivity(running));
}

/// A simulator in a network of its own is ready as soon as its guard can be connected to and its world is
/// loaded, whichever comes first.
void RunningSimulation::note_listening()
{
    if (process_->listening() == Listening::yes && state_.port_opened())
        announce(lease_.port());
}

void RunningSimulation::announce(std::uint16_t port)
{
    SimulationReady ready(port);
    ready.through_gateway = through_gateway_;
    ready.host = host_;
    if (through_gateway_)
        ready.broker = plan_.process.network.broker;
    events_.emplace_back(std::move(ready));
    if (auto const activity = state_.early_activity())
        note_activity(*activity);
}

asio::awaitable<void> RunningSimulation::announce_if_listening()
{
    auto const assigned = lease_.port();
    // Webots takes the next port where some other program has taken its own meanwhile.
    auto const highest = static_cast<std::uint16_t>(std::min(assigned + core::ports_tried_by_webots, 65535));
    auto port = job_.port();
    if (plan_.job.empty())
        port = co_await process_->listening_port(assigned, highest);
    // A simulator can print the line that has told us. Browsers are led to its own ports alone.
    else if (port < assigned || port > highest)
        port = 0;
    if (!plan_.job.empty() && port != 0) {
        auto host = co_await runtime_.address_of(job_.node());
        if (!host)
            co_return stop(host.error());
        host_ = std::move(*host);
    }
    state_.looked_for_port(clock_.now());
    if (port == 0 || !state_.port_opened())
        co_return;
    if (port != assigned)
        log_.warning(LogCause("port"), concat("[", label_, "] Webots listens on port ", std::to_string(port),
                                              " instead of ", std::to_string(assigned)));
    announce(port);
}

void RunningSimulation::terminate_at(Limit limit) noexcept
{
    if (!state_.stop(overrun_failure(limit)))
        return;
    ended_.overrun = limit;
    process_->terminate();
}

void RunningSimulation::on_exit(ExitStatus status, ProcessUsage const& usage)
{
    if (constexpr int first_signal = 128; !plan_.job.empty() && status.code > first_signal)
        status = ExitStatus(status.code - first_signal, true); // srun exits as shells do
    core::Consumption consumption; // of which only what the kernel has refused matters now
    consumption.memory_kills = usage.memory_kills;
    consumption.refused_forks = usage.refused_forks;
    consumption.too_many_files = core::ended_at_file_size(status.code, status.signalled);
    if (auto const limit = core::overrun(limits_, consumption); limit && state_.stop(overrun_failure(*limit)))
        ended_.overrun = limit;
    // The last line may lack its end, and may be what explains the exit.
    lines_.finish([this](std::string_view line) { on_line(line); });
    note_lines_left_out();
    ended_.status = status;
    ended_.was_ready = state_.was_ready();
    ended_.reason = state_.end_reason(describe(status), status == ExitStatus(0, false), start_words_.text());
    state_.exited();
}

void RunningSimulation::stop(Failure reason) noexcept
{
    if (state_.stop(std::move(reason)))
        process_->terminate();
}

} // namespace

SimulationLauncher::SimulationLauncher(SimulationLauncherParams params, ProcessHost& processes, Clock& clock,
                                       Logger log, DockerMode* docker, SlurmMode* slurm)
    : impl_(std::make_unique<Impl>(std::move(params), processes, clock, std::move(log), docker, slurm))
{}

SimulationLauncher::~SimulationLauncher() = default;

asio::awaitable<result<std::unique_ptr<Simulation>>> SimulationLauncher::launch(LaunchSpec spec)
{
    if (!core::is_known_mode(spec.mode))
        co_return core::refused(core::Refused::wrong_mode, {{"mode", core::printable(spec.mode, 40)}});
    // Held until the start: to make the plan may take minutes, in which some other program could take the
    // port.
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
    auto const command = plan->command.empty() ? in_one_line(plan->process.argv) : plan->command;

    // In a network of its own it is reached by a socket in a folder of ours, so that no port of this machine
    // leads to it past the gateway.
    if (uses_gateway(impl_->params, spec) && !impl_->params.brokers.empty() &&
        plan->process.network.reach != ProcessNetwork::Reach::host)
        plan->process.network.broker = impl_->params.brokers / std::to_string(*port);
    hold.reset(); // as late as possible: from now on the simulator can take the port
    auto process = plan->process;
    auto started = co_await impl_->processes.start(std::move(process));
    if (!started) {
        impl_->runtime->forget(*plan);
        if (started.error().info()) // a sentence of its own
            co_return started.error();
        co_return core::refused(started.error().code(), core::Refused::not_started,
                                {{"why", started.error().message()}});
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
