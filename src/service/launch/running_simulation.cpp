// What a simulator prints and does becomes events of its simulation, in the order of `next_event`; how a
// program, containers or a job differ is asked of the runtime.
// Decisions: core/simulation/simulator_state, core/simulation/webots_output, core/simulation/output_budget.
#include "running_simulation.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "core/docker/compose_output.hpp"
#include "core/docker/docker_project.hpp"
#include "core/refusals.hpp"
#include "core/sandbox/limits.hpp"
#include "core/simulation/controller_compiler.hpp"
#include "core/simulation/private_display.hpp"
#include "core/text.hpp"
#include "run_compiler.hpp"
#include "service/run_program.hpp"

#include <algorithm>
#include <optional>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

using State = core::SimulatorState::State;

// Of a container with a controller, and of a file that is copied to a node.
constexpr auto restart_limit = std::chrono::seconds(30);

// How often somebody who waits for a job is told what is new.
constexpr auto news_interval = std::chrono::seconds(1);

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

RunningSimulation::RunningSimulation(SimulationLauncherConfig const& config,
                                     SimulationLauncherFacts const& facts, PortLease lease,
                                     std::unique_ptr<Process> process, ProcessHost& processes, Clock& clock,
                                     Logger log, LaunchSpec spec, SimulatorRuntime& runtime, LaunchPlan plan)
    : lease_(std::move(lease)), process_(std::move(process)), processes_(processes), clock_(clock),
      log_(std::move(log)), label_(std::move(spec.label)), instance_(std::move(spec.instance)),
      simulator_home_(facts.compiler.home), output_(std::move(spec.output)), runtime_(runtime),
      plan_(std::move(plan)), through_gateway_(uses_gateway(config, facts, spec)),
      names_extern_robots_(spec.names_extern_robots), limits_(facts.limits),
      state_(clock.now(), config.start_timeout, config.timeout, config.extendable)
{
    if (!plan_.job.empty())
        limits_.memory = plan_.job_memory;
    for (auto& note : plan_.notes)
        events_.emplace_back(SimulationProgress(std::move(note)));
    if (process_->listening() != Listening::unknown)
        state_.is_told_of_port();
}

asio::awaitable<ProcessUsage> RunningSimulation::usage()
{
    return plan_.job.empty() ? process_->usage() : known_usage(job_usage_);
}

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

} // namespace webots_cloud
