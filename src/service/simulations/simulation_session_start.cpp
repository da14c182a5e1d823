// From a browser's request to a running simulator: the rules are asked, the project is fetched, what it needs
// is compared with what this machine has, and the simulator is started. Whatever fails on the way, the
// browser is told, and simulation_session.cpp cleans up.
// Decisions: core/projects/project_needs, core/simulation/start_refusal, core/simulation/start_figures.
#include "simulation_session.hpp"

#include "async/cancellation.hpp"
#include "async/first_of.hpp"
#include "core/projects/project_needs.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"
#include "stager.hpp"
#include "start_rules.hpp"

#include <boost/asio/this_coro.hpp>

#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr auto progress_interval = std::chrono::milliseconds(500);

std::string progress_text(FetchProgress const& progress)
{
    auto const large_total = progress.large_bytes_total.load();
    auto const large_received = progress.large_bytes_received.load();
    auto const total = progress.objects_total.load();
    auto const received = progress.objects_received.load();
    auto const tenths = (large_total > 0 ? large_received : progress.bytes_received.load()) / 100'000;
    auto const megabytes = concat(std::to_string(tenths / 10), ".", std::to_string(tenths % 10), " MB");
    if (progress.waiting)
        return concat("Waiting for other projects to be fetched (", megabytes, ")");
    auto const percent = [](std::uint64_t part, std::uint64_t whole) {
        return std::to_string(100 * part / whole);
    };
    if (large_total > 0)
        return concat("Receiving large files ", percent(large_received, large_total), "% (", megabytes, ")");
    if (total == 0)
        return concat("Receiving objects (", megabytes, ")");
    return concat("Receiving objects ", percent(received, total), "% (", megabytes, ")");
}

} // namespace

/// Fetches, launches and relays. Cancelled when the browser has left; the caller cleans up.
asio::awaitable<void> SimulationSession::simulate(Channel& channel)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    context_.log.info(LogCause("start"), concat(log_prefix(),
                                                is_fetch_only() ? "Fetching for later starts "
                                                : is_staged()   ? "Staging a simulation from "
                                                                : "Starting simulation from ",
                                                core::printable(core::world_of(request_))));
    auto const fetched = co_await fetch(channel);
    if (!fetched) {
        // Aborted: the browser has left, and there is nobody to tell.
        if (fetched.error().code() != asio::error::operation_aborted)
            refuse(channel, fetched.error(), core::refusal_at(step_, fetched.error()));
        co_return;
    }
    if (is_fetch_only()) {
        fetched_for_later(channel);
        co_return;
    }
    // Known only since the project is here. A machine that lacks something refuses before a simulator is
    // started, and the session server can take another one.
    if (!check_needs(channel))
        co_return;
    if (core::has_editor(request_))
        co_await programs_.read();
    // The browser has a seat, but the staged simulation that was given back for it may not have ended yet.
    if (!is_staged())
        co_await context_.stager->await_seat();
    // The parts above may have missed the cancellation, and a launch is not interrupted once it has begun.
    bool const has_left = co_await async::is_cancelled();
    if (has_left)
        co_return;
    auto const launched = co_await launch(channel);
    if (!launched) {
        refuse(channel, launched.error(), core::refusal_at(step_, launched.error()));
        co_return;
    }
    bool const cancelled = co_await async::is_cancelled(); // a launch is not interrupted: check now
    if (!cancelled)
        co_await relay(channel);
}

/// Whether this machine has what the project needs; otherwise the browser is told. Programs that run without
/// containers ignore `dockerCompose:`, as they always did, unless somebody can choose a machine with them.
bool SimulationSession::check_needs(Channel& channel)
{
    auto const needs = core::project_needs(std::exchange(project_->webots_yml, {}));
    if (!needs) {
        refuse(channel, needs.error(), core::StartRefusal::everywhere);
        return false;
    }
    auto const needed = core::is_relayed(request_) ? needs->all() : needs->labels;
    auto const missing = core::lacking(needed, context_.facts.labels);
    needed_labels_ = needs->labels;
    if (missing.empty())
        return true;
    refuse(channel, core::lacks_labels(missing), core::needs_message(needed));
    return false;
}

/// Asks the rules about worlds (docs/recipes.md, "A rule about worlds"), then the fetcher.
asio::awaitable<result<Project>> SimulationSession::fetch_requested(std::shared_ptr<FetchProgress> progress)
{
    auto admitted = may_start(context_, request_);
    // A staged simulation takes no place of a browser's; the browser that claims it does (`claim`).
    if (admitted && !is_staged())
        admitted = take_place(context_, quota_key_, request_, place_);
    if (!admitted)
        co_return admitted.error();
    auto const* const website = std::get_if<WebsiteProject>(&request_);
    // The rules of this machine have let it pass: what fails from here on is the project, or its site.
    step_ = website ? core::StartStep::website : core::StartStep::repository;
    if (website)
        co_return co_await context_.fetcher.fetch(*website, std::move(progress));
    auto const ref = context_.fetcher.parse(std::get<core::StartMessage>(request_).url);
    if (!ref)
        co_return ref.error();
    co_return co_await context_.fetcher.fetch(*ref, std::move(progress));
}

asio::awaitable<result<>> SimulationSession::fetch(Channel& channel)
{
    auto progress = std::make_shared<FetchProgress>();
    // The progress never ends by itself: the fetch decides.
    auto parts = async::first_of(fetch_project(progress), show_progress(progress, channel));
    auto const fetched = co_await std::move(parts);
    if (!fetched)
        co_return fetched.error();
    introduce(channel);
    if (!is_fetch_only())
        passed(core::StartStage::fetch, life_.fetched(context_.clock.now()));
    co_return result<>();
}

/// What a browser is told of its project before it learns where its simulation is.
void SimulationSession::introduce(Channel& channel)
{
    if (!project_->notice.empty())
        (void)channel.send(core::loading_message(project_->notice));
    for (auto const& path : project_->forbidden)
        (void)channel.send(core::forbidden_file_message(path));
}

/// Counts a stage of a start that a browser waits for.
void SimulationSession::passed(core::StartStage stage, Duration took)
{
    if (!is_staged())
        context_.start_figures.passed(stage, took);
}

/// What was fetched stays in the cache; the caller removes the copy that was made of it.
void SimulationSession::fetched_for_later(Channel& channel)
{
    life_.fetched_for_later();
    context_.fetch_figures.fetched();
    context_.log.info(LogCause("fetched"), concat(log_prefix(), "The project is here for later starts"));
    (void)channel.send(std::string(core::fetched_message));
    channel.close(1000);
}

/// Stores the project in a member instead of returning it: a result would be lost, and the project with it,
/// when the browser leaves at the moment of success.
asio::awaitable<result<>> SimulationSession::fetch_project(std::shared_ptr<FetchProgress> progress)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto project = co_await fetch_requested(std::move(progress));
    if (!project)
        co_return project.error();
    project_ = std::move(*project);
    context_.stager->on_fetch(id_, *project_);
    co_return result<>();
}

/// Sends the progress of the fetch to the browser whenever it has changed. Ends only when cancelled.
asio::awaitable<result<>> SimulationSession::show_progress(std::shared_ptr<FetchProgress const> progress,
                                                           Channel& channel)
{
    auto& clock = context_.clock;
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

/// Opens the log for what the simulator prints, if such logs are kept.
void SimulationSession::open_output(LaunchSpec& spec)
{
    if (!context_.hooks.simulation_logs)
        return;
    output_ = context_.hooks.simulation_logs->open(id_);
    output_->write(concat("Output of ", core::world_of(request_)));
    context_.log.info(LogCause("output"), concat(log_prefix(), "What Webots prints is in ", output_->name()));
    spec.output = [log = output_.get()](std::string_view line) { log->write(line); };
}

LaunchSpec SimulationSession::launch_spec() const
{
    LaunchSpec spec;
    spec.instance = project_->directory;
    spec.root = project_->root;
    spec.world = project_->world;
    spec.world_header = project_->world_header;
    spec.label = std::to_string(id_);
    spec.needed_labels = needed_labels_;
    // Websites expect a Webots of their time, which has another command line.
    if (auto const* website = std::get_if<WebsiteProject>(&request_)) {
        spec.old_command_line = true;
        spec.controller_edit = website->may_edit();
        spec.mode = website->mode;
    } else {
        spec.mode = std::get<core::StartMessage>(request_).mode;
        spec.names_extern_robots = context_.config.controller_port != 0 && context_.launcher.config().gateway;
    }
    return spec;
}

asio::awaitable<result<>> SimulationSession::launch(Channel& channel)
{
    step_ = core::StartStep::launch;
    auto spec = launch_spec();
    open_output(spec);
    auto simulation = co_await context_.launcher.launch(std::move(spec));
    if (!simulation)
        co_return simulation.error();
    simulation_ = std::move(*simulation);
    auto const now = context_.clock.now();
    usage_.begin(now, project_->directory);
    passed(core::StartStage::launch, life_.launched(now, simulation_->ends_at()));
    for (auto const& announcement : simulation_->announcements())
        (void)channel.send(announcement);
    // Browsers that send `init` don't know the message.
    if (std::holds_alternative<core::StartMessage>(request_))
        tell_time(channel, context_.launcher.config().timeout);
    co_return result<>();
}

/// The simulator has ended before it was ready. At a limit, the world needs too much.
void SimulationSession::refuse_start(SimulationEnded const& ended, Channel& channel)
{
    refuse(channel, ended.reason,
           ended.overrun ? core::StartRefusal::everywhere : core::refusal_at(step_, ended.reason));
}

} // namespace webots_cloud
