#include "simulation_session.hpp"

#include "../async/cancellation.hpp"
#include "../core/text.hpp"

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/this_coro.hpp>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

using namespace asio::experimental::awaitable_operators;

constexpr auto progress_interval = std::chrono::milliseconds(500);

std::string_view name_of(SimulationSession::State state)
{
    switch (state) {
    case SimulationSession::State::fetching:
        return "fetching the project";
    case SimulationSession::State::launching:
        return "loading the world";
    case SimulationSession::State::idle:
        return "idle";
    case SimulationSession::State::running:
        return "running";
    }
    return {};
}

std::string progress_text(FetchProgress const& progress)
{
    auto const total = progress.objects_total.load();
    auto const received = progress.objects_received.load();
    auto const tenths = progress.bytes_received.load() / 100'000;
    auto const megabytes = concat(std::to_string(tenths / 10), ".", std::to_string(tenths % 10), " MB");
    if (total == 0)
        return concat("Receiving objects (", megabytes, ")");
    return concat("Receiving objects ", std::to_string(std::uint64_t{100} * received / total), "% (",
                  megabytes, ")");
}

} // namespace

SimulationSession::SimulationSession(SessionSurroundings& surroundings, std::uint64_t id,
                                     core::SimulationRequest request)
    : surroundings_(surroundings), id_(id), request_(std::move(request)), since_(surroundings.clock.now()),
      stage_began_(since_)
{}

std::string SimulationSession::name() const
{
    return concat("[", std::to_string(id_), "] ");
}

void SimulationSession::look_at_processes()
{
    if (!simulation_ || ended_)
        return;
    auto const now = surroundings_.clock.now();
    auto const used = simulation_->usage();
    cpu_ = core::process_cpu_percent(used_.processor, used.processor, now - looked_);
    used_ = used;
    looked_ = now;
}

core::SimulationRow SimulationSession::row() const
{
    core::SimulationRow row;
    row.id = id_;
    row.world = core::short_world(core::world_of(request_));
    row.state = name_of(state_);
    row.age = surroundings_.clock.now() - since_;
    if (simulation_) {
        row.process = simulation_->process_id();
        row.cpu = cpu_;
        if (cpu_)
            row.memory = static_cast<double>(used_.memory_bytes) / 1e6;
    }
    return row;
}

asio::awaitable<void> SimulationSession::run(Channel& channel)
{
    // Whichever ends first ends the other: the browser's departure, or the simulation.
    co_await (host(channel) || watch(channel));
    channel.close(); // what was said is still delivered; the browser need not wait for the cleaning up
    if (!start_over_)
        surroundings_.starts.abandoned();
    co_await clean_up();
}

/// Everything that a browser may still say while its simulation lives. Ends when the browser has gone.
asio::awaitable<void> SimulationSession::watch(Channel& channel)
{
    for (;;) {
        auto const text = co_await channel.receive();
        if (!text)
            co_return;
        if (std::holds_alternative<core::SimulationRequest>(core::parse_client_message(*text)))
            (void)channel.send(
                core::error_message("This connection has started a simulation already: open another one."));
    }
}

void SimulationSession::tell(Channel& channel, std::string_view error)
{
    surroundings_.log.error(concat(name(), core::printable(error)));
    (void)channel.send(core::error_message(error));
}

/// The start has failed.
void SimulationSession::refuse(Channel& channel, Failure const& failure)
{
    start_over_ = true;
    surroundings_.starts.failed(failure);
    tell(channel, failure.message());
}

/// The start has come through a stage.
void SimulationSession::pass(core::StartStage stage)
{
    auto const now = surroundings_.clock.now();
    surroundings_.starts.passed(stage, now - stage_began_);
    stage_began_ = now;
    start_over_ = stage == core::StartStage::ready;
}

/// Fetch, launch, relay. Cancelled when the browser has gone; cleaning up is the caller's.
asio::awaitable<void> SimulationSession::host(Channel& channel)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    surroundings_.log.info(
        concat(name(), "Starting simulation from ", core::printable(core::world_of(request_))));
    auto const fetched = co_await fetch(channel);
    if (!fetched) {
        if (fetched.error().code() != asio::error::operation_aborted)
            refuse(channel, fetched.error());
        co_return;
    }
    auto const launched = co_await launch(channel);
    if (!launched) {
        refuse(channel, launched.error());
        co_return;
    }
    bool const cancelled = co_await async::is_cancelled(); // a start can't be cancelled halfway: look now
    if (!cancelled)
        co_await relay(channel);
}

/// Whether this machine takes the simulation. The projects of websites are the operator's own: no policy is
/// needed.
result<> SimulationSession::admission() const
{
    if (surroundings_.draining)
        return Failure(errc::refused,
                       "This simulation server is about to stop. Please start again on another one.");
    auto const* start = std::get_if<core::StartMessage>(&request_);
    if (!start)
        return {};
    if (auto const refused = core::refusal(surroundings_.policy, start->url, surroundings_.load))
        return Failure(errc::refused, *refused);
    return {};
}

asio::awaitable<result<Project>> SimulationSession::fetch_requested(std::shared_ptr<FetchProgress> progress)
{
    auto const admitted = admission();
    if (auto const* website = std::get_if<WebsiteProject>(&request_)) {
        if (!admitted)
            co_return admitted.error();
        co_return co_await surroundings_.fetcher.fetch(*website, std::move(progress));
    }
    auto const ref = surroundings_.fetcher.parse(std::get<core::StartMessage>(request_).url);
    if (!ref)
        co_return ref.error();
    if (!admitted)
        co_return admitted.error();
    co_return co_await surroundings_.fetcher.fetch(*ref, std::move(progress));
}

asio::awaitable<result<>> SimulationSession::fetch(Channel& channel)
{
    auto progress = std::make_shared<FetchProgress>();
    auto outcome = co_await (fetch_requested(progress) || show_progress(progress, channel));
    if (outcome.index() == 1)
        co_return std::get<1>(outcome).error();
    auto& project = std::get<0>(outcome);
    if (!project)
        co_return project.error();
    project_ = std::move(*project);
    pass(core::StartStage::fetch);
    co_return result<>();
}

/// Tells the browser how far the fetch is, while there is something new. Ends only when cancelled.
asio::awaitable<result<>> SimulationSession::show_progress(std::shared_ptr<FetchProgress const> progress,
                                                           Channel& channel)
{
    auto& clock = surroundings_.clock;
    std::string last;
    for (;;) {
        auto const waited = co_await clock.wait_until(clock.now() + progress_interval);
        if (!waited)
            co_return waited;
        auto text = progress_text(*progress);
        if (text != last)
            (void)channel.send(core::loading_message(text));
        last = std::move(text);
    }
}

LaunchSpec SimulationSession::launch_spec() const
{
    LaunchSpec spec;
    spec.world = project_->world;
    spec.world_header = project_->world_header;
    spec.label = std::to_string(id_);
    if (auto const* website = std::get_if<WebsiteProject>(&request_)) {
        spec.old_command_line = true;
        spec.controller_edit = website->may_edit();
    } else {
        spec.mode = std::get<core::StartMessage>(request_).mode;
    }
    return spec;
}

asio::awaitable<result<>> SimulationSession::launch(Channel& channel)
{
    state_ = State::launching;
    auto spec = launch_spec();
    auto simulation = co_await surroundings_.launcher.launch(std::move(spec));
    if (!simulation)
        co_return simulation.error();
    simulation_ = std::move(*simulation);
    looked_ = surroundings_.clock.now();
    pass(core::StartStage::launch);
    auto const timeout =
        std::chrono::duration_cast<std::chrono::seconds>(surroundings_.launcher.params().timeout);
    if (std::holds_alternative<core::StartMessage>(
            request_)) // browsers that send `init` don't know the message
        (void)channel.send(core::shutdown_timeout_message(timeout.count()));
    co_return result<>();
}

asio::awaitable<void> SimulationSession::relay(Channel& channel)
{
    for (;;) {
        auto const event = co_await simulation_->next_event();
        if (!event)
            co_return;
        if (auto const* ready = std::get_if<SimulationReady>(&*event)) {
            state_ = State::idle;
            pass(core::StartStage::ready);
            surroundings_.log.info(concat(name(), "Webots world is loaded, ready to receive connections"));
            (void)channel.send(core::webots_message(surroundings_.address, ready->port));
        } else if (std::holds_alternative<SimulationHeartbeat>(*event)) {
            (void)channel.send(".");
        } else if (auto const* activity = std::get_if<SimulationActivity>(&*event)) {
            state_ = activity->running ? State::running : State::idle;
        } else {
            ended_ = true;
            auto const& ended = std::get<SimulationEnded>(*event);
            if (ended.was_ready)
                tell(channel, ended.reason);
            else
                refuse(channel, Failure(errc::start_failed, ended.reason));
            co_return;
        }
    }
}

asio::awaitable<void> SimulationSession::clean_up()
{
    if (simulation_) {
        auto const process = concat("Webots [", std::to_string(simulation_->process_id()), "] ");
        surroundings_.log.info(concat(name(), process, ended_ ? "exited" : "was killed"));
        simulation_->terminate();
        while (!ended_) {
            auto const event = co_await simulation_->next_event();
            ended_ = !event || std::holds_alternative<SimulationEnded>(*event);
        }
        simulation_.reset();
    }
    if (project_) {
        auto project = std::move(*project_);
        co_await surroundings_.fetcher.discard(std::move(project));
    }
}

} // namespace webots_cloud
