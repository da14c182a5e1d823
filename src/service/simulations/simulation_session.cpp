// One browser and its simulation: who has it, what is said on /client, and what ends it. The start comes
// first (simulation_session_start.cpp), and whatever happens, `clean_up` comes last. A staged simulation
// (`run_staged`) goes the same way without a browser.
// docs/inside.md, "One simulation", has the picture.
// Decisions: core/simulation/simulation_life, core/simulation/simulator_greeting.
#include "simulation_session.hpp"

#include "async/cancellation.hpp"
#include "async/first_of.hpp"
#include "core/refusals.hpp"
#include "core/simulation/simulator_greeting.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"
#include "service/tell.hpp"
#include "stager.hpp"
#include "start_rules.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

using Life = core::SimulationLife;

std::string_view name_of(Life::Stage stage)
{
    switch (stage) {
    case Life::Stage::fetching:
        return "fetching the project";
    case Life::Stage::launching:
        return "loading the world";
    case Life::Stage::idle:
        return "idle";
    case Life::Stage::running:
        return "running";
    }
    return {};
}

/// In place of a browser while none is connected.
class ClosedChannel final : public Channel
{
public:
    result<> send(std::string) override { return Failure(errc::closed); }
    asio::awaitable<result<std::string>> receive() override { co_return Failure(errc::closed); }
    void close(std::uint16_t, std::string) override {}
};

Duration grace_for(SessionContext const& context, core::SimulationRequest const& request)
{
    return context.hooks.new_token ? context.config.grace(core::can_return(request)) : Duration::zero();
}

} // namespace

SimulationSession::SimulationSession(SessionContext& context, asio::any_io_executor const& executor,
                                     std::uint64_t id, std::string quota_key, core::SimulationRequest request,
                                     Browser browser)
    : context_(context), id_(id), quota_key_(std::move(quota_key)), request_(std::move(request)),
      life_(grace_for(context, request_), context.clock.now(), context.state.is_stopping()),
      arrived_(context.clock.now()), programs_(context_, executor, project_, simulation_),
      life_changed_(executor), released_(executor)
{
    if (browser == Browser::awaited)
        life_.begin_staged();
    else if (!is_fetch_only())
        context.start_figures.arrived();
}

std::string SimulationSession::log_prefix() const
{
    return concat("[", std::to_string(id_), "] ");
}

bool SimulationSession::is_starting() const noexcept
{
    return stage() == Life::Stage::fetching || stage() == Life::Stage::launching;
}

WorldKey SimulationSession::world_key() const
{
    auto const* start = std::get_if<core::StartMessage>(&request_);
    return webots_cloud::world_key(core::world_of(request_), start ? start->mode : std::string());
}

std::string_view SimulationSession::state_name() const
{
    if (is_fetch_only())
        return "fetching for later";
    if (is_staged())
        return is_staged_and_ready() ? "staged" : "being staged";
    return life_.state() == Life::State::waiting ? "waiting for its browser" : name_of(life_.stage());
}

core::SimulationRow SimulationSession::row() const
{
    core::SimulationRow row;
    row.id = id_;
    row.world = core::short_world(core::world_of(request_));
    row.state = state_name();
    row.staged = is_staged_and_ready();
    row.age = context_.clock.now() - arrived_;
    if (output_)
        row.log = output_->name();
    if (simulation_) {
        row.process = simulation_->process_id();
        usage_.describe(row);
    }
    return row;
}

asio::awaitable<void> SimulationSession::run(Channel& channel)
{
    // Whichever ends first cancels the others: the simulation, the browser's connection, or the wait for
    // another connection that takes over.
    greet(channel);
    auto parts =
        async::first_of(async::as_part(simulate(channel)), async::as_part(receive(channel)),
                        async::as_part(programs_.compile_wishes(channel)), async::as_part(await_takeover()));
    (void)co_await std::move(parts);
    channel_ = nullptr;
    co_await finish(channel);
}

asio::awaitable<void> SimulationSession::run_staged()
{
    ClosedChannel nobody;
    auto parts = async::first_of(async::as_part(simulate(nobody)), async::as_part(await_takeover()));
    (void)co_await std::move(parts);
    // A browser has claimed the simulation, or it is over. `claimed` waits for this: two coroutines must not
    // wait for the events of one simulation.
    auto const next = end_connection();
    released_.notify();
    if (next.action != Life::Action::hand_over)
        co_await clean_up(next.exited);
}

bool SimulationSession::claim(std::string const& quota_key, core::SimulationRequest const& request)
{
    auto const before = std::exchange(request_, request);
    quota_key_ = quota_key;
    // In this order: a place can be given back, but a simulation that has been taken can't be staged again.
    if (may_start(context_, request_) && take_place(context_, quota_key_, request_, place_) &&
        life_.take_staged(grace_for(context_, request_))) {
        arrived_ = context_.clock.now();
        introduced_ = false;
        life_changed_.notify();
        return true;
    }
    place_.release();
    request_ = before;
    return false;
}

asio::awaitable<bool> SimulationSession::claimed()
{
    (void)co_await released_.wait();
    if (life_.is_over())
        co_return false;
    context_.start_figures.arrived();
    // Its browser has waited for none of the stages. They are counted, so that each start has all of them.
    for (auto const stage : {core::StartStage::fetch, core::StartStage::launch, core::StartStage::ready})
        passed(stage, Duration::zero());
    // The time limit is the browser's, and has run since the simulation was launched.
    simulation_->restart_time();
    life_.extended(simulation_->ends_at());
    if (life_.has_grace())
        token_ = context_.hooks.new_token();
    // It was staged for a page with an editor, whether its browser has one or not.
    if (!core::has_editor(request_))
        programs_.forget();
    co_return true;
}

void SimulationSession::give_back()
{
    if (life_.give_back())
        life_changed_.notify();
}

asio::awaitable<void> SimulationSession::resume(Channel& channel)
{
    greet(channel);
    // A browser that gets a staged simulation has missed what is told during a start.
    if (!std::exchange(introduced_, true)) {
        introduce(channel);
        co_await greet_simulator(channel);
    }
    tell_time(channel, life_.time_left(context_.clock.now()));
    announce(channel);
    auto parts =
        async::first_of(async::as_part(relay(channel)), async::as_part(receive(channel)),
                        async::as_part(programs_.compile_wishes(channel)), async::as_part(await_takeover()));
    (void)co_await std::move(parts);
    channel_ = nullptr;
    co_await finish(channel);
}

void SimulationSession::greet(Channel& channel)
{
    channel_ = &channel;
    if (core::wants_heartbeat(request_))
        (void)channel.send(std::string(core::heartbeat_promise));
}

void SimulationSession::send_heartbeat()
{
    if (channel_ && core::wants_heartbeat(request_))
        (void)channel_->send(std::string(core::heartbeat_message));
}

asio::awaitable<bool> SimulationSession::take_over()
{
    if (!life_.take_over())
        co_return false;
    life_changed_.notify();
    (void)co_await released_.wait();
    co_return !life_.is_over();
}

void SimulationSession::on_server_stop()
{
    if (life_.server_stops() && channel_)
        refuse(*channel_, core::refused(core::Refused::server_stops), core::StartRefusal::here);
    life_changed_.notify();
}

bool SimulationSession::end_by_operator()
{
    if (!life_.operator_ends())
        return false;
    context_.log.warning(LogCause("operator"), concat(log_prefix(), "The operator ends this simulation"));
    life_changed_.notify();
    return true;
}

/// Where the operator has ended the simulation. A connection that is just being taken over leaves that to the
/// next one.
void SimulationSession::tell_who_ended(Channel& channel)
{
    if (life_.was_ended_by_operator() && life_.state() != Life::State::handing_over)
        refuse(channel, core::refused(core::Refused::ended_by_operator), core::StartRefusal::everywhere);
}

/// Ends when another connection takes over, when the operator ends the simulation, or when the server stops
/// while it waits for the browser.
asio::awaitable<void> SimulationSession::await_takeover()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled || life_.must_let_go())
            co_return;
        (void)co_await life_changed_.wait();
    }
}

/// The browser has left, or the simulation has ended: waits for the browser if its connection broke, and
/// cleans up unless another connection takes over.
asio::awaitable<void> SimulationSession::finish(Channel& channel)
{
    tell_who_ended(channel);
    // What was sent is still delivered; the browser need not wait for the clean-up.
    if (life_.state() == Life::State::handing_over && core::can_return(request_))
        channel.close(core::taken_over_code, "another page has taken the simulation over");
    else
        channel.close();
    auto next = end_connection();
    if (next.action == Life::Action::await_return) {
        ++context_.changes;
        co_await await_return(next.until);
        next = end_connection();
    }
    // Also where nothing is handed over: the simulator may have ended just when another connection wanted it,
    // and that waits for this (`take_over`).
    released_.notify();
    if (next.action == Life::Action::hand_over)
        co_return;
    if (next.abandoned && is_fetch_only())
        context_.fetch_figures.abandoned();
    else if (next.abandoned)
        context_.start_figures.abandoned();
    // The page closes its connections to the simulator at the same moment. What it still says there should
    // arrive before we cut it off.
    if (next.quit)
        co_await gateway_.close_after_goodbyes();
    co_await clean_up(next.exited);
}

Life::Next SimulationSession::end_connection()
{
    auto const next = life_.connection_ended(context_.clock.now());
    if (next.loss != Life::Loss::none)
        log_loss(next.loss);
    return next;
}

asio::awaitable<void> SimulationSession::await_return(TimePoint until)
{
    ClosedChannel closed_channel;
    // Its output is read meanwhile: with a full pipe the simulator would stand still, and it may end by
    // itself.
    auto parts = async::first_of(async::as_part(relay(closed_channel)), async::as_part(await_takeover()),
                                 context_.clock.wait_until(until));
    (void)co_await std::move(parts);
}

/// Logs why the connection ended, and what follows from that.
void SimulationSession::log_loss(Life::Loss loss)
{
    if (loss == Life::Loss::not_returned) {
        context_.log.info(LogCause("lost"),
                          concat(log_prefix(), "The browser has not returned: the simulation is ended"));
        return;
    }
    auto const grace = std::chrono::duration<double>(life_.grace()).count();
    std::string what_follows = "it was not ready yet, and is ended";
    if (loss == Life::Loss::awaited)
        what_follows = concat("it may return for ", core::python_float(grace), " s");
    else if (loss == Life::Loss::not_awaited)
        what_follows = "it is ended at once, since there is no \"reconnectGrace\"";
    context_.log.info(LogCause("lost"), concat(log_prefix(), "The simulation has lost its browser: ",
                                               loss_reason_, "; ", what_follows));
}

bool SimulationSession::streams_pictures() const
{
    return !pictures_.empty() && stage() == core::SimulationLife::Stage::running;
}

std::string_view SimulationSession::address() const noexcept
{
    auto const* const start = std::get_if<core::StartMessage>(&request_);
    return start ? std::string_view(start->url) : std::string_view();
}

void SimulationSession::note_leaving(Failure const& failure, Channel const& channel)
{
    using Leaving = Life::Leaving;
    auto const code = channel.farewell();
    if (failure == errc::unreachable) {
        life_.browser_left(Leaving::lost);
        loss_reason_ = failure.message();
    } else if (core::can_return(request_) && !core::is_final(code)) {
        life_.browser_left(Leaving::page_left);
        loss_reason_ = concat("its page was left or reloaded (close code ", std::to_string(code), ")");
    } else {
        life_.browser_left(Leaving::for_good);
    }
}

/// Answers the messages of the browser. Ends with its connection.
asio::awaitable<void> SimulationSession::receive(Channel& channel)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return;
        auto const text = co_await channel.receive();
        if (!text) {
            note_leaving(text.error(), channel);
            co_return;
        }
        auto const message = core::parse_client_message(*text);
        if (auto const* reset = std::get_if<core::ResetControllerMessage>(&message))
            co_await reset_controller(reset->file, channel);
        else if (auto const* read = std::get_if<core::ReadFileMessage>(&message))
            programs_.show(*read, channel);
        else if (auto const* write = std::get_if<core::WriteFileMessage>(&message))
            co_await programs_.save(*write, channel);
        else if (auto const* compile = std::get_if<core::CompileMessage>(&message))
            programs_.wish(*compile, channel);
        else if (auto const* wish = std::get_if<core::ExtendMessage>(&message))
            extend(wish->by, channel);
        else if (auto const* malformed = std::get_if<core::MalformedMessage>(&message))
            tell_wrong_message(channel, malformed->reason, wants_reasons());
        // All others that we know come first on a connection, and this one has its simulation.
        else if (!std::holds_alternative<core::UnknownMessage>(message))
            tell(channel, core::refused(core::Refused::second_start), wants_reasons());
    }
}

asio::awaitable<void> SimulationSession::reset_controller(std::string file, Channel& channel)
{
    if (!project_) {
        tell(channel, core::refused(core::Refused::still_fetching), wants_reasons());
        co_return;
    }
    auto const restored = co_await programs_.restore(file);
    if (restored)
        (void)channel.send(core::reset_controller_message(file));
    else
        send_error(channel, restored.error());
}

void SimulationSession::send_error(Channel& channel, Failure const& error)
{
    auto const client = std::to_string(id_);
    context_.log.error(LogCause("failure", client), concat(log_prefix(), core::printable(error.message())));
    tell(channel, error, wants_reasons());
}

void SimulationSession::refuse(Channel& channel, Failure const& failure, core::StartRefusal refusal)
{
    refuse(channel, failure, core::refusal_message(refusal));
}

/// The start has failed. `announcement`: what a session server is told before that; possibly empty.
void SimulationSession::refuse(Channel& channel, Failure const& failure, std::string_view announcement)
{
    bool const is_first = life_.failed() && !is_staged();
    if (is_first && is_fetch_only())
        context_.fetch_figures.failed(failure);
    else if (is_first)
        context_.start_figures.failed(failure);
    if (core::is_relayed(request_) && !announcement.empty())
        (void)channel.send(std::string(announcement));
    send_error(channel, failure);
}

/// `left`: of the time limit of the simulation.
void SimulationSession::tell_time(Channel& channel, Duration left)
{
    auto const seconds = [](Duration time) {
        return std::chrono::duration_cast<std::chrono::seconds>(time).count();
    };
    (void)channel.send(core::shutdown_timeout_message(seconds(left)));
    if (core::can_extend(request_) && context_.launcher.config().extendable > Duration::zero())
        (void)channel.send(core::extendable_message(seconds(simulation_->extendable())));
}

void SimulationSession::extend(Duration by, Channel& channel)
{
    auto const granted = simulation_ ? simulation_->extend(by) : Duration::zero();
    if (granted <= Duration::zero()) {
        tell(channel, core::refused(core::Refused::not_extended), wants_reasons());
        return;
    }
    life_.extended(simulation_->ends_at());
    context_.log.info(LogCause("extend", std::to_string(id_)),
                      concat(log_prefix(), "The browser has extended the simulation by ",
                             core::seconds_text(granted), " s"));
    tell_time(channel, life_.time_left(context_.clock.now()));
}

/// The page has said what it will want of its simulator: that is said before it hears the address.
asio::awaitable<void> SimulationSession::greet_simulator(Channel& channel)
{
    auto greeting = core::greeting_for(request_);
    if (!greeting || !context_.hooks.simulator_talk || !gateway_.is_passed_on())
        co_return;
    auto simulator = gateway_.simulator();
    auto words = greeting->words;
    auto last = greeting->last;
    auto const heard =
        co_await context_.hooks.simulator_talk->talk(std::move(simulator), std::move(words), std::move(last));
    for (auto& message : core::said_messages(heard))
        (void)channel.send(std::move(message));
    if (core::is_answered(*greeting, heard))
        pictures_ = core::pictures_message(greeting->picture_size);
    else
        context_.log.warning(LogCause("greeting"),
                             concat(log_prefix(), "The simulator has not answered the server in time, "
                                                  "so its page has to wait longer for pictures"));
}

/// The simulation is ready: sends its address, the token with which the browser can return, and where
/// controllers of its robots connect.
void SimulationSession::announce(Channel& channel)
{
    if (!pictures_.empty())
        (void)channel.send(pictures_);
    gateway_.send_address(channel);
    if (!token_.empty())
        (void)channel.send(core::reconnect_token_message(token_));
    programs_.list(channel);
    gateway_.tell_controllers(channel);
}

asio::awaitable<void> SimulationSession::relay(Channel& channel)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        auto const event = co_await simulation_->next_event();
        if (!event)
            co_return;
        if (auto const* progress = std::get_if<SimulationProgress>(&*event)) {
            (void)channel.send(core::loading_message(progress->text));
        } else if (std::holds_alternative<SimulationAllocated>(*event)) {
            // The time limit counts from here, not from when the job was queued.
            life_.extended(simulation_->ends_at());
            if (std::holds_alternative<core::StartMessage>(request_))
                tell_time(channel, context_.launcher.config().timeout);
        } else if (auto const* ready = std::get_if<SimulationReady>(&*event)) {
            on_ready(*ready);
            if (!is_staged())
                co_await greet_simulator(channel);
            bool const has_left = co_await async::is_cancelled(); // meanwhile
            if (has_left)
                co_return;
            announce(channel);
        } else if (std::holds_alternative<SimulationHeartbeat>(*event)) {
            (void)channel.send(".");
        } else if (auto* waiting = std::get_if<SimulationExternRobot>(&*event)) {
            gateway_.note_extern_robot(std::move(waiting->name), channel);
        } else if (auto const* activity = std::get_if<SimulationActivity>(&*event)) {
            life_.activity(activity->running);
            // A staged world that runs would use up a processor for nobody, and browsers would not get its
            // beginning.
            if (is_staged() && activity->running) {
                context_.log.warning(LogCause("staged"),
                                     concat(log_prefix(), "The world does not stay paused, "
                                                          "so it can't be staged"));
                co_return;
            }
        } else {
            life_.exited();
            auto const& ended = std::get<SimulationEnded>(*event);
            if (ended.overrun)
                ++context_.overruns[*ended.overrun];
            // A browser that has its simulation is told what has ended it. One that still waits is refused,
            // so that a session server can try another machine.
            if (ended.was_ready)
                send_error(channel, ended.reason);
            else
                refuse_start(ended, channel);
            co_return;
        }
    }
}

void SimulationSession::on_ready(SimulationReady const& ready)
{
    passed(core::StartStage::ready, life_.ready(context_.clock.now()));
    ++context_.changes;
    context_.log.info(LogCause("ready"),
                      concat(log_prefix(), "Webots world is loaded, ready to receive connections"));
    // What the project announces decides whether its gateway has a port for an editor.
    auto const& told = simulation_->announcements();
    gateway_.open(ready, request_, std::find(told.begin(), told.end(), core::editor_message) != told.end());
    if (is_staged())
        context_.stager->on_ready(id_);
    else if (life_.has_grace())
        token_ = context_.hooks.new_token();
}

asio::awaitable<void> SimulationSession::clean_up(bool exited)
{
    // From now on nobody reaches what is being ended.
    gateway_.close();
    if (simulation_) {
        auto const process = concat("Webots [", std::to_string(simulation_->process_id()), "] ");
        context_.log.info(LogCause("end"), concat(log_prefix(), process, exited ? "exited" : "was killed"));
        simulation_->terminate();
        // The simulator still writes into its folder until it has ended.
        while (!exited) {
            auto const event = co_await simulation_->next_event();
            exited = !event || std::holds_alternative<SimulationEnded>(*event);
        }
        simulation_.reset();
    }
    // Not before: otherwise there would be more simulators than seats for a moment.
    place_.release();
    output_.reset();
    if (project_) {
        auto project = std::move(*project_);
        co_await context_.fetcher.discard(std::move(project));
    }
    life_.cleaned_up();
}

} // namespace webots_cloud
