#include <webots_cloud/simulation_launcher.hpp>

#include "../core/launch_plan.hpp"
#include "../core/port_pool.hpp"
#include "../core/text.hpp"
#include "../core/webots_output.hpp"
#include "../async/deadline.hpp"

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

std::string seconds_of(Duration duration)
{
    return std::to_string(std::chrono::duration_cast<std::chrono::seconds>(duration).count());
}

std::string describe(ExitStatus const& status)
{
    return concat(status.signalled ? "it was ended by signal " : "it exited with status ", std::to_string(status.code));
}

} // namespace

struct SimulationLauncher::Impl
{
    ProcessSpec process_for(LaunchSpec const& spec, std::uint16_t port) const;

    Impl(SimulationLauncherParams parameters, ProcessHost& host, Clock& time, Logger logger) :
        params(std::move(parameters)), processes(host), clock(time), log(std::move(logger)),
        ports(params.first_port, params.most_simulations)
    {}

    SimulationLauncherParams params;
    ProcessHost& processes;
    Clock& clock;
    Logger log;
    core::PortPool ports;
};

ProcessSpec SimulationLauncher::Impl::process_for(LaunchSpec const& spec, std::uint16_t port) const
{
    ProcessSpec process;
    process.environment = core::webots_environment(params.environment, params.display);
    process.directory = spec.world.parent_path();
    process.grace = params.grace;
    if (spec.old_command_line) {
        core::OldStream stream;
        stream.controller_edit = spec.controller_edit;
        stream.ssl = params.old_webots_tls;
        stream.multimedia_server = params.old_webots_multimedia_server;
        stream.multimedia_stream = params.old_webots_multimedia_stream;
        process.argv = core::old_webots_command(params.webots, stream, port, spec.world);
        process.environment.emplace_back(core::old_webots_sandbox);
    } else {
        auto const mode = core::stream_mode(spec.mode, core::parse_world_header(spec.world_header));
        process.argv = core::webots_command(params.webots, mode, port, spec.world);
    }
    return process;
}

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
    RunningSimulation(SimulationLauncherParams const& params, PortLease lease, std::unique_ptr<Process> process,
                      Clock& clock, Logger log, LaunchSpec spec) :
        lease_(std::move(lease)),
        process_(std::move(process)), clock_(clock), log_(std::move(log)), label_(std::move(spec.label)), output_(std::move(spec.output)),
        timeout_(params.timeout), start_timeout_(params.start_timeout), end_of_life_(clock.now() + params.timeout),
        ready_by_(std::min(clock.now() + params.start_timeout, end_of_life_))
    {}

    asio::awaitable<result<SimulationEvent>> next_event() override;
    void terminate() noexcept override { stop({}); }
    int process_id() const noexcept override { return process_->id(); }
    ProcessUsage usage() const override { return process_->usage(); }

private:
    TimePoint next_deadline() const;
    void on_deadline();
    void on_output(std::string_view bytes);
    void on_line(std::string_view line);
    void on_exit(ExitStatus status);
    void announce_if_listening();
    void stop(std::string reason) noexcept;

    PortLease lease_;
    std::unique_ptr<Process> process_;
    Clock& clock_;
    Logger log_;
    std::string label_;
    std::function<void(std::string_view)> output_;
    Duration timeout_;
    Duration start_timeout_;
    TimePoint end_of_life_;
    TimePoint ready_by_;

    core::LineSplitter lines_;
    std::string last_line_;
    std::string stop_reason_;
    std::deque<SimulationEvent> events_;
    bool loaded_ = false;
    bool ready_ = false;
    bool stopping_ = false;
    std::optional<SimulationEnded> ended_;
};

asio::awaitable<result<SimulationEvent>> RunningSimulation::next_event()
{
    while (events_.empty()) {
        if (ended_)
            co_return SimulationEvent(*ended_);
        // While it is stopping the process host keeps the time: its grace is short, and then it kills.
        auto const deadline = stopping_ ? TimePoint::max() : next_deadline();
        auto event = co_await async::with_deadline(clock_, deadline, process_->next_event());
        if (!event && event.error() == errc::timed_out) {
            on_deadline();
        } else if (!event) {
            co_return event.error();
        } else if (auto const* output = std::get_if<ProcessOutput>(&*event)) {
            on_output(output->bytes);
        } else {
            on_exit(std::get<ExitStatus>(*event));
        }
    }
    SimulationEvent const event = std::move(events_.front());
    events_.pop_front();
    co_return event;
}

TimePoint RunningSimulation::next_deadline() const
{
    if (ready_)
        return end_of_life_;
    return loaded_ ? std::min(ready_by_, clock_.now() + listening_check) : ready_by_;
}

void RunningSimulation::on_deadline()
{
    if (clock_.now() >= end_of_life_)
        stop(concat("The simulation reached its time limit of ", seconds_of(timeout_), " s."));
    else if (ready_ || clock_.now() < ready_by_)
        announce_if_listening();
    else if (loaded_)
        stop(concat("Webots loaded the world but opened no port within ", seconds_of(start_timeout_), " s."));
    else
        stop(concat("Webots did not load the world within ", seconds_of(start_timeout_), " s."));
}

void RunningSimulation::on_output(std::string_view bytes)
{
    auto const each = [this](std::string_view line) { on_line(line); };
    lines_.feed(bytes, each);
}

void RunningSimulation::on_line(std::string_view line)
{
    auto const kind = core::classify_output(line);
    if (output_ && kind != core::OutputLine::heartbeat)
        output_(line);
    switch (kind) {
    case core::OutputLine::heartbeat:
    case core::OutputLine::open:
        if (ready_)
            events_.emplace_back(SimulationHeartbeat());
        else if (!stopping_) {
            loaded_ = true;
            announce_if_listening();
        }
        break;
    case core::OutputLine::paused:
        events_.emplace_back(SimulationActivity{false});
        break;
    case core::OutputLine::running:
        events_.emplace_back(SimulationActivity{true});
        break;
    case core::OutputLine::reset:
        break;
    case core::OutputLine::other:
        if (!core::trim(line).empty())
            last_line_ = core::printable(core::trim(line), 200);
        log_.debug(concat("[", label_, "] webots: ", core::printable(line)));
    }
}

void RunningSimulation::announce_if_listening()
{
    auto const ports = process_->listening_ports();
    auto const highest = lease_.port() + ports_tried_by_webots;
    auto const found = std::find_if(ports.begin(), ports.end(),
                                    [&](std::uint16_t port) { return port >= lease_.port() && port <= highest; });
    if (found == ports.end())
        return;
    if (*found != lease_.port())
        log_.warning(concat("[", label_, "] Webots listens on port ", std::to_string(*found), " instead of ",
                            std::to_string(lease_.port())));
    ready_ = true;
    events_.emplace_back(SimulationReady{*found});
}

void RunningSimulation::on_exit(ExitStatus status)
{
    lines_.finish([this](std::string_view line) { on_line(line); });
    SimulationEnded ended;
    ended.status = status;
    ended.was_ready = ready_;
    if (stopping_)
        ended.reason = stop_reason_;
    else if (!ready_)
        ended.reason = concat("Unable to start Webots: ", describe(status), " before the world was loaded",
                              last_line_.empty() ? "." : ": " + last_line_);
    else if (status == ExitStatus(0, false))
        ended.reason = "Webots has quit.";
    else
        ended.reason = concat("Webots has quit unexpectedly: ", describe(status), ".");
    ended_ = std::move(ended);
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

SimulationLauncher::SimulationLauncher(SimulationLauncherParams params, ProcessHost& processes, Clock& clock, Logger log) :
    impl_(std::make_unique<Impl>(std::move(params), processes, clock, std::move(log)))
{}

SimulationLauncher::~SimulationLauncher() = default;

asio::awaitable<result<std::unique_ptr<Simulation>>> SimulationLauncher::launch(LaunchSpec spec)
{
    if (!core::is_known_mode(spec.mode))
        co_return Failure(errc::invalid_argument, concat("Unsupported client mode: ", core::printable(spec.mode, 40),
                                                         ". Expected w3d, x3d or mjpeg."));
    std::unique_ptr<PortHold> hold;
    auto const take = [&](std::uint16_t port) {
        auto taken = impl_->processes.hold_port(port);
        if (!taken) {
            impl_->log.info(concat("Port ", std::to_string(port), " is already in use."));
            return false;
        }
        hold = std::move(*taken);
        return true;
    };
    auto const port = impl_->ports.acquire(take);
    if (!port)
        co_return port.error();
    PortLease lease(impl_->ports, *port);

    auto process = impl_->process_for(spec, *port);
    std::string command;
    for (auto const& argument : process.argv)
        command.append(command.empty() ? "" : " ").append(argument);

    hold.reset(); // as late as possible: from now on the port is the simulator's to take
    auto started = co_await impl_->processes.start(std::move(process));
    if (!started)
        co_return Failure(started.error().code(), concat("Unable to start Webots: ", started.error().message()));
    impl_->log.info(concat("[", spec.label, "] Webots [", std::to_string((*started)->id()), "] started: \"",
                           core::printable(command, 1024), "\""));
    co_return std::make_unique<RunningSimulation>(impl_->params, std::move(lease), std::move(*started), impl_->clock,
                                                  impl_->log, std::move(spec));
}

std::size_t SimulationLauncher::running() const noexcept { return impl_->ports.lent(); }

SimulationLauncherParams const& SimulationLauncher::params() const noexcept { return impl_->params; }

} // namespace webots_cloud
