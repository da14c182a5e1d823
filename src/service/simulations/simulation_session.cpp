// One browser and its simulation, in the order of events: the rules are asked, the project is fetched, the
// simulator started, its address announced, and whatever happens, `clean_up` comes last. A staged simulation
// (`run_staged`) goes the same way without a browser.
// docs/inside.md, "One simulation", has the picture.
// Decisions: core/simulation/simulation_life, core/access/admission, core/projects/repository_policy.
// Decisions: core/simulation/editable_files, core/access/controller_address.
#include "simulation_session.hpp"

#include "async/cancellation.hpp"
#include "async/first_of.hpp"
#include "core/access/asked_name.hpp"
#include "core/access/controller_greeting.hpp"
#include "core/sandbox/limits.hpp"
#include "core/simulation/port_pool.hpp"
#include "core/simulation/public_base.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"
#include "service/tell.hpp"
#include "stager.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr std::string_view programs_folder = "controllers"; // of a project
constexpr auto progress_interval = std::chrono::milliseconds(500);
// For close frames on their way, before what is still connected to a simulation is cut off.
constexpr auto goodbye_time = std::chrono::milliseconds(500);

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
    return context.hooks.new_token ? context.params.config.grace(core::can_return(request))
                                   : Duration::zero();
}

} // namespace

SimulationSession::SimulationSession(SessionContext& context, asio::any_io_executor const& executor,
                                     std::uint64_t id, std::string quota_key, core::SimulationRequest request,
                                     Browser browser)
    : context_(context), id_(id), quota_key_(std::move(quota_key)), request_(std::move(request)),
      life_(grace_for(context, request_), context.clock.now(), context.state.is_stopping()),
      started_(context.clock.now()), life_changed_(executor), released_(executor)
{
    if (browser == Browser::awaited)
        life_.begin_staged();
    else if (!is_fetch_only())
        context.starts.arrived();
}

std::string SimulationSession::log_prefix() const
{
    return concat("[", std::to_string(id_), "] ");
}

asio::awaitable<void> SimulationSession::look_at_processes()
{
    if (!simulation_ || life_.state() == Life::State::exited)
        co_return;
    auto const used = co_await simulation_->usage(); // the simulation may have ended meanwhile
    if (!simulation_ || life_.state() == Life::State::exited)
        co_return;
    if (used.counted && *used.counted <= measured_)
        co_return; // we know that already
    auto const now = used.counted.value_or(context_.clock.now());
    cpu_ = core::process_cpu_percent(used_.processor, used.processor, now - measured_);
    graphics_ = core::process_cpu_percent(used_.graphics, used.graphics, now - measured_) / 100;
    used_ = used;
    measured_ = now;
}

void SimulationSession::keep_process_limits()
{
    if (!simulation_ || life_.state() == Life::State::exited)
        return;
    core::Consumption used;
    used.memory = used_.own_memory_bytes;
    used.processes = used_.processes;
    used.memory_kills = used_.memory_kills;
    used.refused_forks = used_.refused_forks;
    if (auto const limit = core::overrun(context_.launcher.params().limits, used))
        simulation_->terminate_at(*limit);
}

asio::awaitable<void> SimulationSession::look_at_folder(FolderMeter& meter)
{
    auto const& limits = context_.launcher.params().limits;
    if (!simulation_ || !project_ || life_.state() == Life::State::exited ||
        context_.clock.now() < folder_due_)
        co_return;
    auto const began = context_.clock.now();
    auto directory = project_->directory;
    auto use = co_await meter.measure(std::move(directory), limits.disk);
    if (!simulation_)
        co_return;
    auto const elsewhere = co_await simulation_->written_elsewhere();
    auto const now = context_.clock.now();
    // A tenth of the time of one thread; more only while there is little room for others.
    bool const is_urgent = use.free_bytes < 2 * limits.disk;
    folder_due_ = is_urgent ? now : began + 10 * (now - began);
    if (!simulation_ || life_.state() == Life::State::exited) // it may have ended meanwhile
        co_return;
    core::Consumption used;
    used.disk = use.bytes + elsewhere.files;
    used.images = elsewhere.images;
    used.too_many_files = use.too_many_files;
    if (auto const limit = core::overrun(limits, used))
        simulation_->terminate_at(*limit);
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
    row.age = context_.clock.now() - started_;
    if (output_)
        row.log = output_->name();
    if (simulation_) {
        row.process = simulation_->process_id();
        row.cpu = cpu_;
        row.more = !used_.complete;
        if (cpu_) {
            row.memory = static_cast<double>(used_.memory_bytes) / 1e6;
            row.processes = used_.processes;
            row.graphics = 100 * graphics_;
        }
    }
    return row;
}

asio::awaitable<void> SimulationSession::run(Channel& channel)
{
    // Whichever ends first cancels the others: the simulation, the browser's connection, or the wait for
    // another connection that takes over.
    greet(channel);
    auto parts = async::first_of(async::as_part(simulate(channel)), async::as_part(receive(channel)),
                                 async::as_part(await_takeover()));
    (void)co_await std::move(parts);
    channel_ = nullptr;
    co_await finish(channel);
}

asio::awaitable<void> SimulationSession::run_staged()
{
    ClosedChannel nobody;
    auto parts = async::first_of(async::as_part(simulate(nobody)), async::as_part(await_takeover()));
    (void)co_await std::move(parts);
    auto const next = end_connection();
    released_.notify();
    if (next.action != Life::Action::hand_over)
        co_await clean_up(next.exited);
}

bool SimulationSession::claim(std::string const& quota_key, core::SimulationRequest const& request)
{
    auto const before = std::exchange(request_, request);
    quota_key_ = quota_key;
    if (may_start() && take_place() && life_.take_staged(grace_for(context_, request_))) {
        started_ = context_.clock.now();
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
    context_.starts.arrived();
    for (auto const stage : {core::StartStage::fetch, core::StartStage::launch, core::StartStage::ready})
        passed(stage, Duration::zero());
    simulation_->restart_time();
    life_.extended(simulation_->ends_at());
    if (life_.has_grace())
        token_ = context_.hooks.new_token();
    if (!core::has_editor(request_))
        programs_.reset();
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
    if (!std::exchange(introduced_, true))
        introduce(channel);
    tell_time(channel, life_.time_left(context_.clock.now()));
    announce(channel);
    auto parts = async::first_of(async::as_part(relay(channel)), async::as_part(receive(channel)),
                                 async::as_part(await_takeover()));
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

/// What a browser is told of its project before it learns where its simulation is.
void SimulationSession::introduce(Channel& channel)
{
    if (!project_->notice.empty())
        (void)channel.send(core::loading_message(project_->notice));
    for (auto const& path : project_->forbidden)
        (void)channel.send(core::forbidden_file_message(path));
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
    released_.notify();
    if (next.action == Life::Action::hand_over)
        co_return;
    if (next.abandoned && is_fetch_only())
        context_.fetches.abandoned();
    else if (next.abandoned)
        context_.starts.abandoned();
    if (next.quit)
        co_await await_goodbyes();
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

bool SimulationSession::has_port(std::uint16_t port) const
{
    if (port == ready_.port)
        return true;
    auto const& told = simulation_->announcements();
    return port == ready_.port + core::editor_distance &&
           std::find(told.begin(), told.end(), core::editor_message) != told.end();
}

Upstream SimulationSession::simulator() const
{
    Upstream simulator(ready_.host, ready_.port);
    simulator.broker = ready_.broker;
    return simulator;
}

bool SimulationSession::streams_pictures() const
{
    auto const* const start = std::get_if<core::StartMessage>(&request_);
    return start && start->mode == "mjpeg" && stage() == core::SimulationLife::Stage::running;
}

std::string_view SimulationSession::address() const noexcept
{
    auto const* const start = std::get_if<core::StartMessage>(&request_);
    return start ? std::string_view(start->url) : std::string_view();
}

Forward SimulationSession::forward(core::GatewayPath const& path, IncomingRequest const& request) const
{
    Forward forward;
    bool const is_editor = is_editors(path.port);
    forward.upstream = is_editor ? Upstream("127.0.0.1", path.port) : simulator();
    forward.target = path.rest;
    if (!request.query.empty())
        forward.target.append("?").append(request.query);
    forward.group = tunnels_;
    forward.in_messages = request.upgrade && path.rest == core::pictures_path && !is_editor;
    forward.added_answer_headers.emplace_back("Content-Security-Policy",
                                              is_editor ? core::editor_policy : core::sandbox_policy);
    if (is_editor)
        return forward; // Docker opens that port of the machine for the editor
    // Webots names its own files in what it serves by http:// and this header.
    if (!request.upgrade) {
        auto base = request.is_from_proxy
                        ? core::parse_public_base(request.header(core::public_address_header))
                        : std::nullopt;
        if (!base)
            base = core::public_base(core::reached_at(
                context_.params.address, core::asked_address(request.headers, request.is_from_proxy)));
        forward.headers.emplace_back("Host", core::gateway_authority(*base, address_token_, ready_.port));
        // Webots says so of files, but not of pictures, which pages read to notice when they grow old.
        forward.answer_headers.emplace_back("Access-Control-Allow-Origin", "*");
    }
    return forward;
}

void SimulationSession::limit_traffic()
{
    if (tunnels_)
        tunnels_->set_limit(context_.params.config.traffic_limit);
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
            show_program(*read, channel);
        else if (auto const* write = std::get_if<core::WriteFileMessage>(&message))
            co_await save_program(*write, channel);
        else if (auto const* wish = std::get_if<core::ExtendMessage>(&message))
            extend(wish->by, channel);
        else if (auto const* malformed = std::get_if<core::MalformedMessage>(&message))
            tell_wrong_message(channel, malformed->reason, wants_reasons());
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
    auto const name = concat(programs_folder, "/", file);
    auto restored = co_await context_.fetcher.restore(*project_, name);
    if (restored && simulation_) {
        auto path = project_->root / name;
        restored = co_await simulation_->put_back(std::move(path));
    }
    if (restored && programs_)
        programs_->restored(file);
    if (restored)
        (void)channel.send(core::reset_controller_message(file));
    else
        send_error(channel, restored.error());
}

/// Takes the programs as they were fetched, before a simulator runs that could have changed them.
asio::awaitable<void> SimulationSession::read_programs()
{
    auto* const files = context_.hooks.program_files;
    if (!files || !context_.params.config.allow_edit || !core::has_editor(request_))
        co_return;
    TextLimits limits;
    limits.bytes = core::largest_editable;
    limits.files = core::most_editable;
    auto found = co_await files->read_all(project_->root / programs_folder, limits);
    core::EditableFiles::Texts texts;
    if (found)
        for (auto& [name, text] : *found)
            texts.emplace(std::move(name), std::move(text));
    std::vector<std::string> world{project_->world.lexically_relative(project_->root).generic_string()};
    auto const read = co_await files->read(project_->root, std::move(world));
    bool const is_there = read && read->front();
    programs_.emplace(std::move(texts), is_there ? std::string_view(*read->front()) : std::string_view());
}

/// Sends the page that can show them what there is to change.
void SimulationSession::list_programs(Channel& channel)
{
    if (programs_ && !programs_->empty())
        (void)channel.send(programs_->list_message());
}

void SimulationSession::show_program(core::ReadFileMessage const& wish, Channel& channel)
{
    auto const text =
        programs_ ? programs_->read(wish.file, wish.original) : core::refused(core::Refused::not_editable);
    (void)channel.send(text ? core::file_message(wish.file, *text, wish.original)
                            : core::file_error_message(wish.file, text.error()));
}

asio::awaitable<void> SimulationSession::save_program(core::WriteFileMessage program, Channel& channel)
{
    auto const [file, text] = std::move(program);
    auto saved = programs_ ? programs_->may_save(file, text, context_.clock.now())
                           : core::refused(core::Refused::not_editable);
    if (saved) {
        std::vector<TextFile> files{TextFile(concat(programs_folder, "/", file), text)};
        saved = co_await context_.hooks.program_files->write(project_->root, std::move(files));
    }
    if (saved && simulation_) {
        auto path = project_->root / programs_folder / file;
        saved = co_await simulation_->put_back(std::move(path));
    }
    if (saved)
        programs_->saved(file, text);
    (void)channel.send(saved ? core::file_saved_message(file)
                             : core::file_error_message(file, saved.error()));
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
        context_.fetches.failed(failure);
    else if (is_first)
        context_.starts.failed(failure);
    if (core::is_relayed(request_) && !announcement.empty())
        (void)channel.send(std::string(announcement));
    send_error(channel, failure);
}

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
        if (fetched.error().code() != asio::error::operation_aborted)
            refuse(channel, fetched.error(), core::refusal_at(step_, fetched.error()));
        co_return;
    }
    if (is_fetch_only()) {
        fetched_for_later(channel);
        co_return;
    }
    if (!check_needs(channel))
        co_return;
    co_await read_programs();
    if (!is_staged())
        co_await context_.stager->await_seat();
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

/// Whether worlds of this repository may run here. The projects of websites need no policy: the operator
/// chose them.
result<> SimulationSession::check_policy() const
{
    auto const* start = std::get_if<core::StartMessage>(&request_);
    if (!start)
        return {};
    auto const forge = context_.fetcher.forge_of(start->url);
    if (!forge)
        return forge.error();
    core::ForgeOfWorld const place(forge->address.url, forge->source.get().ref_meaning(),
                                   forge->address.kind);
    if (auto why = core::refusal(context_.policy, start->url, place, context_.load))
        return std::move(*why);
    return {};
}

/// Whether its robots may be controlled from other machines. Websites' projects run with Webots R2021b or
/// older, which knows no such controllers.
bool SimulationSession::takes_controllers() const
{
    auto const* start = std::get_if<core::StartMessage>(&request_);
    auto const& config = context_.params.config;
    if (!start || config.controller_port == 0 || !context_.hooks.new_address_token)
        return false;
    auto const forge = context_.fetcher.forge_of(start->url);
    if (!forge)
        return false;
    core::ForgeOfWorld const place(forge->address.url, forge->source.get().ref_meaning(),
                                   forge->address.kind);
    return std::ranges::any_of(config.controller_repositories, [&](std::string const& rule) {
        return core::allows(rule, start->url, place);
    });
}

/// Whether this machine takes the simulation, if it has a place for it. Refused before anything is fetched.
result<> SimulationSession::may_start() const
{
    if (context_.state.is_draining())
        return core::refused(core::Refused::server_drains);
    return check_policy();
}

/// Takes a place, if the machine has room for one more simulation, and the world and the client may have
/// another one.
result<> SimulationSession::take_place()
{
    using Verdict = core::Admission::Verdict;
    std::string world; // of a website's projects none
    if (auto const* start = std::get_if<core::StartMessage>(&request_)) {
        auto const parsed = context_.fetcher.parse(start->url); // of however many links to it
        world = parsed ? parsed->address() : start->url;
    }
    auto& admission = context_.admission;
    auto const verdict = admission.admit(quota_key_, world, place_);
    if (verdict == Verdict::admitted) {
        context_.stager->on_change();
        return {};
    }
    if (verdict == Verdict::world_full)
        return core::refused(core::Refused::world_has_enough,
                             {{"max", std::to_string(admission.simulations_per_world())}});
    if (verdict == Verdict::full)
        return core::too_many_simulations(admission.max_simulations());
    auto const& full = admission.full_client();
    auto const max = std::to_string(full.allowed);
    if (verdict == Verdict::client_full_first)
        context_.log.warning(LogCause("simulation limit"),
                             concat("More than ", max, " simulations of ", full.key,
                                    " are refused: see \"simulationsPerAddress\", and \"trustedProxies\" if "
                                    "that is a proxy"));
    return core::refused(core::Refused::client_has_enough, {{"count", max}});
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
    auto const missing = core::lacking(needed, context_.params.labels);
    needed_labels_ = needs->labels;
    if (missing.empty())
        return true;
    refuse(channel, core::lacks_labels(missing), core::needs_message(needed));
    return false;
}

/// Asks the rules about worlds (docs/recipes.md, "A rule about worlds"), then the fetcher.
asio::awaitable<result<Project>> SimulationSession::fetch_requested(std::shared_ptr<FetchProgress> progress)
{
    auto admitted = may_start();
    if (admitted && !is_staged())
        admitted = take_place();
    if (!admitted)
        co_return admitted.error();
    auto const* const website = std::get_if<WebsiteProject>(&request_);
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
    auto parts = async::first_of(fetch_project(progress), show_progress(progress, channel));
    auto const fetched = co_await std::move(parts);
    if (!fetched)
        co_return fetched.error();
    introduce(channel);
    if (!is_fetch_only())
        passed(core::StartStage::fetch, life_.fetched(context_.clock.now()));
    co_return result<>();
}

/// Counts a stage of a start that a browser waits for.
void SimulationSession::passed(core::StartStage stage, Duration took)
{
    if (!is_staged())
        context_.starts.passed(stage, took);
}

/// What was fetched stays in the cache; the caller removes the copy that was made of it.
void SimulationSession::fetched_for_later(Channel& channel)
{
    life_.fetched_for_later();
    context_.fetches.fetched();
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
    if (auto const* website = std::get_if<WebsiteProject>(&request_)) {
        spec.old_command_line = true;
        spec.controller_edit = website->may_edit();
        spec.mode = website->mode;
    } else {
        spec.mode = std::get<core::StartMessage>(request_).mode;
        spec.names_extern_robots =
            context_.params.config.controller_port != 0 && context_.launcher.params().config.gateway;
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
    measured_ = context_.clock.now();
    passed(core::StartStage::launch, life_.launched(measured_, simulation_->ends_at()));
    for (auto const& announcement : simulation_->announcements())
        (void)channel.send(announcement);
    // Browsers that send `init` don't know the message.
    if (std::holds_alternative<core::StartMessage>(request_))
        tell_time(channel, context_.launcher.params().config.timeout);
    co_return result<>();
}

/// `left`: of the time limit of the simulation.
void SimulationSession::tell_time(Channel& channel, Duration left)
{
    auto const seconds = [](Duration time) {
        return std::chrono::duration_cast<std::chrono::seconds>(time).count();
    };
    (void)channel.send(core::shutdown_timeout_message(seconds(left)));
    if (core::can_extend(request_) && context_.launcher.params().config.extendable > Duration::zero())
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

/// Where its browser reaches this server, `ws://...`.
std::string SimulationSession::reached_at() const
{
    return public_base_.empty() ? core::public_base(core::reached_at(context_.params.address, asked_))
                                : public_base_;
}

/// The simulation is ready: sends its address, the token with which the browser can return, and where
/// controllers of its robots connect.
void SimulationSession::announce(Channel& channel)
{
    auto const& own = context_.params.address;
    if (ready_.through_gateway) {
        (void)channel.send(core::webots_gateway_message(reached_at(), address_token_, ready_.port));
    } else { // at a port of which no proxy's word about this server says anything
        AskedAddress by_host;
        by_host.host = asked_.host;
        (void)channel.send(core::webots_message(core::reached_at(own, by_host), ready_.port));
    }
    if (!token_.empty())
        (void)channel.send(core::reconnect_token_message(token_));
    list_programs(channel);
    for (std::size_t robot = 0; robot < extern_robots_.names().size(); ++robot)
        tell_controller(robot, channel);
}

/// A robot waits for its controller: its author is told where that connects, once there is such a place.
void SimulationSession::note_extern_robot(std::string robot, Channel& channel)
{
    if (extern_robots_.add(std::move(robot)) && !address_token_.empty())
        tell_controller(extern_robots_.names().size() - 1, channel);
}

void SimulationSession::tell_controller(std::size_t robot, Channel& channel) const
{
    auto const& name = extern_robots_.names().at(robot);
    auto const& config = context_.params.config;
    if (controller_key_.empty()) {
        (void)channel.send(core::no_controller_message(name));
        return;
    }
    auto const place =
        core::controller_place(config.controller_address, reached_at(), config.controller_port);
    auto const url = core::controller_url(place, controller_key_, extern_robots_, robot);
    (void)channel.send(core::controller_message(name, url));
}

/// From now on the simulation is reached through this server, by those who know its tokens.
void SimulationSession::open_tunnels()
{
    address_token_ = context_.hooks.new_address_token();
    if (takes_controllers())
        controller_key_ = context_.hooks.new_address_token().substr(0, core::controller_key_length);
    tunnels_ = std::make_shared<TunnelGroup>(context_.params.config.traffic_limit);
}

ControllerWay SimulationSession::way_of_controller(std::string_view robot) const
{
    ControllerWay way;
    way.upstream = Upstream(ready_.host, ready_.port);
    way.upstream.broker = ready_.broker;
    way.asks_for = extern_robots_.resolve(robot);
    way.group = tunnels_;
    return way;
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
            life_.extended(simulation_->ends_at());
            if (std::holds_alternative<core::StartMessage>(request_))
                tell_time(channel, context_.launcher.params().config.timeout);
        } else if (auto const* ready = std::get_if<SimulationReady>(&*event)) {
            on_ready(*ready);
            announce(channel);
        } else if (std::holds_alternative<SimulationHeartbeat>(*event)) {
            (void)channel.send(".");
        } else if (auto* waiting = std::get_if<SimulationExternRobot>(&*event)) {
            note_extern_robot(std::move(waiting->name), channel);
        } else if (auto const* activity = std::get_if<SimulationActivity>(&*event)) {
            life_.activity(activity->running);
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
    ready_ = ready;
    if (ready_.through_gateway)
        open_tunnels();
    if (is_staged())
        context_.stager->on_ready(id_);
    else if (life_.has_grace())
        token_ = context_.hooks.new_token();
}

/// The simulator has ended before it was ready. At a limit, the world needs too much.
void SimulationSession::refuse_start(SimulationEnded const& ended, Channel& channel)
{
    refuse(channel, ended.reason,
           ended.overrun ? core::StartRefusal::everywhere : core::refusal_at(step_, ended.reason));
}

void SimulationSession::close_tunnels()
{
    address_token_.clear();
    controller_key_.clear();
    if (!tunnels_)
        return;
    tunnels_->close();
    context_.received += tunnels_->received();
    context_.sent += tunnels_->sent();
    tunnels_.reset();
}

/// A page that quits closes its WebSocket to the simulator in the same moment. It takes that for a failure,
/// and says so, unless the simulator's own close frame comes back: so neither the tunnels nor the simulator
/// end before, or before `goodbye_time`, as others may be watching.
asio::awaitable<void> SimulationSession::await_goodbyes()
{
    address_token_.clear();
    controller_key_.clear();
    if (!tunnels_)
        co_return;
    auto const executor = co_await asio::this_coro::executor;
    auto const emptied = std::make_shared<async::Wakeup>(executor);
    tunnels_->refuse_new([emptied] { emptied->notify(); });
    auto& clock = context_.clock;
    auto parts = async::first_of(emptied->wait(), clock.wait_until(clock.now() + goodbye_time));
    (void)co_await std::move(parts);
    close_tunnels();
}

asio::awaitable<void> SimulationSession::clean_up(bool exited)
{
    close_tunnels();
    if (simulation_) {
        auto const process = concat("Webots [", std::to_string(simulation_->process_id()), "] ");
        context_.log.info(LogCause("end"), concat(log_prefix(), process, exited ? "exited" : "was killed"));
        simulation_->terminate();
        while (!exited) {
            auto const event = co_await simulation_->next_event();
            exited = !event || std::holds_alternative<SimulationEnded>(*event);
        }
        simulation_.reset();
    }
    place_.release();
    output_.reset();
    if (project_) {
        auto project = std::move(*project_);
        co_await context_.fetcher.discard(std::move(project));
    }
    life_.cleaned_up();
}

} // namespace webots_cloud
