// The simulation server from above: who is on /client, which sessions there are, and what else is asked. A
// browser gets a SimulationSession, which does the rest; what the server tells about itself is
// status_endpoints.cpp's.
// Decisions: core/access/admission, core/projects/outside_projects, core/simulation/gateway_address.
#include <webots_cloud/simulation_service.hpp>

#include "async/deadline.hpp"
#include "async/first_of.hpp"
#include "core/access/tickets.hpp"
#include "core/gallery/world_list.hpp"
#include "core/pages/http_pages.hpp"
#include "core/pages/monitor_sample.hpp"
#include "core/projects/outside_projects.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/simulation/public_base.hpp"
#include "core/simulation/start_refusal.hpp"
#include "core/text.hpp"
#include "limit_watch.hpp"
#include "local_worlds.hpp"
#include "repository_worlds.hpp"
#include "service/route_table.hpp"
#include "service/tell.hpp"
#include "simulation_session.hpp"
#include "stager.hpp"
#include "status_endpoints.hpp"
#include "world_pictures.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <array>
#include <span>
#include <unordered_map>
#include <variant>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

/// The first message of a browser that asks for a simulation; `monostate`: it left, or sent no valid request
/// in time.
using FirstRequest =
    std::variant<std::monostate, core::SimulationRequest, core::ReconnectMessage, core::StageMessage>;

core::AdmissionLimits limits_of(SimulationServiceConfig const& service,
                                SimulationLauncherConfig const& launcher)
{
    core::AdmissionLimits limits;
    limits.max_simulations = launcher.max_simulations;
    limits.max_silent = service.max_silent;
    limits.silent_per_address = service.silent_per_address;
    return limits;
}

} // namespace

struct SimulationService::Impl
{
    Impl(SimulationServiceConfig wanted, SimulationServiceFacts found, ProjectFetcher& projects,
         SimulationLauncher& simulators, HostMetrics& metrics, Clock& clock, Logger logger,
         SimulationServiceHooks service_hooks)
        : config(std::move(wanted)), facts(std::move(found)), hooks(std::move(service_hooks)),
          context(config, facts, hooks, projects, simulators, clock, std::move(logger),
                  limits_of(config, simulators.config())),
          status(context, sessions, metrics), pictures(hooks.picture_taker, sessions, clock),
          worlds(hooks.world_finder, context.policy, pictures, clock),
          stager(context, sessions, [this] { return ++last_id; })
    {
        context.stager = &stager;
        apply_config();
    }

    static std::span<Route<Impl> const> routes();
    Answer front_page(IncomingRequest const& request);
    Answer client_without_upgrade(IncomingRequest const& request);
    Answer list_worlds(IncomingRequest const& request) { return worlds.answer(request); }
    Answer world_picture(IncomingRequest const& request);
    Answer no_folder(IncomingRequest const& request);
    bool has_ticket(IncomingRequest const& request) const;
    bool admit(std::uint64_t id, ChannelInfo const& info, core::SimulationRequest const& request,
               Channel& channel);
    bool may_stage(ChannelInfo const& info, Channel& channel);
    std::optional<Failure> refuse_way(ChannelInfo const& info) const;
    bool leads_to_simulation(IncomingRequest const& request) const;
    Answer forward(IncomingRequest const& request);
    SimulationGateway const* simulation_at(core::GatewayPath const& path) const;
    void apply_config();
    void stop();
    void add_silent(std::uint64_t id, std::string const& quota_key, Channel& channel);
    void remove_silent(std::uint64_t id);
    asio::awaitable<result<>> measure();
    asio::awaitable<result<>> watch_limits();
    asio::awaitable<FirstRequest> receive_request(std::uint64_t id, Channel& channel);
    asio::awaitable<void> simulate(std::uint64_t id, ChannelInfo info, core::SimulationRequest request,
                                   Channel& channel);
    asio::awaitable<void> reconnect(std::uint64_t id, ChannelInfo info, std::string token, Channel& channel);
    void forget_if_over(SimulationSession const& session);
    std::shared_ptr<SimulationSession> find_session(std::string_view token) const;

    SimulationServiceConfig config;
    SimulationServiceFacts const facts;
    SimulationServiceHooks const hooks;
    SessionContext context;
    SimulationSessions sessions;
    StatusEndpoints status;
    WorldPictures pictures;
    LocalWorlds worlds;
    RepositoryWorlds repositories{context, worlds};
    Stager stager;
    std::uint64_t last_id = 0;
    std::size_t clients = 0; ///< Browsers on /client, with and without a simulation.
    /// The channels of those that have not asked for a simulation yet.
    std::unordered_map<std::uint64_t, Channel*> silent_channels;
};

SimulationService::SimulationService(SimulationServiceConfig config, SimulationServiceFacts facts,
                                     ProjectFetcher& fetcher, SimulationLauncher& launcher,
                                     HostMetrics& metrics, Clock& clock, Logger log,
                                     SimulationServiceHooks hooks)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(facts), fetcher, launcher, metrics, clock,
                                   std::move(log), std::move(hooks)))
{}

SimulationService::~SimulationService() = default;

double SimulationService::load() const noexcept
{
    return impl_->status.load();
}

std::size_t SimulationService::sessions() const noexcept
{
    return static_cast<std::size_t>(
        std::ranges::count_if(impl_->sessions, [](auto const& entry) { return !entry.second->is_staged(); }));
}

void SimulationService::drain(bool exit_when_empty)
{
    impl_->status.drain(exit_when_empty);
}

void SimulationService::apply(SimulationServiceConfig config)
{
    impl_->config = std::move(config);
    impl_->status.refresh_pages();
    impl_->apply_config();
}

void SimulationService::Impl::apply_config()
{
    auto const& repositories = config.repositories;
    context.policy = {repositories, core::judge_outside_projects(facts.walls, !repositories.allowed.empty())};
    context.admission.set_simulations_per_address(
        static_cast<std::size_t>(config.limit_of_an_address(context.admission.max_simulations())));
    context.admission.set_simulations_per_world(static_cast<std::size_t>(config.simulations_per_world));
    worlds.refresh();
    for (auto const& [id, session] : sessions)
        session->gateway().limit_traffic();
    stager.apply();
}

asio::awaitable<result<>> SimulationService::run()
{
    auto parts = async::first_of(impl_->measure(), impl_->status.look_at_processes(), impl_->worlds.run(),
                                 impl_->pictures.run(), impl_->stager.run());
    if (impl_->context.launcher.facts().limits.any())
        parts = async::first_of(std::move(parts), impl_->watch_limits());
    co_return co_await std::move(parts);
}

asio::awaitable<result<>> SimulationService::Impl::watch_limits()
{
    bool const has_disk = context.launcher.facts().limits.disk > 0;
    if (!has_disk || !hooks.folder_meter)
        co_return co_await watch_processes(context, sessions);
    auto watches = async::first_of(watch_processes(context, sessions),
                                   watch_folders(context, sessions, *hooks.folder_meter));
    co_return co_await std::move(watches);
}

/// Once a second, until the server is stopped or has finished.
asio::awaitable<result<>> SimulationService::Impl::measure()
{
    auto& clock = context.clock;
    for (;;) {
        // On whole seconds, so that the lines of monitor.csv of several machines can be laid side by side.
        auto const next = clock.now() + core::until_next_second(clock.wall());
        auto const waited = co_await clock.wait_until(next);
        // We are being ended: the sessions, which belong to their connections, are told.
        if (!waited) {
            stop();
            co_return waited;
        }
        status.measure(next, clients);
        for (auto const& [id, session] : sessions)
            session->send_heartbeat();
        if (status.has_finished())
            co_return result<>();
    }
}

Answer SimulationService::respond(IncomingRequest const& request)
{
    if (StatusEndpoints::serves(request.path))
        return impl_->status.answer(request);
    return route_table::respond(Impl::routes(), *impl_, request);
}

std::uint64_t SimulationService::max_body(IncomingRequest const& request)
{
    return RepositoryWorlds::serves(request) ? RepositoryWorlds::longest_body : 0;
}

asio::awaitable<HttpResponse> SimulationService::respond_to_body(IncomingRequest const& request)
{
    return impl_->repositories.answer(request);
}

/// All that is not of the StatusEndpoints.
std::span<Route<SimulationService::Impl> const> SimulationService::Impl::routes()
{
    static constexpr auto table = std::to_array<Route<Impl>>({
        // clang-format off
        {"/",             core::Methods::read, everybody,                  Upgrade::ignored,  &Impl::front_page},
        {"/client",       core::Methods::get,  everybody,                  Upgrade::accepted, &Impl::client_without_upgrade},
        {"/worlds",       core::Methods::read, everybody,                  Upgrade::ignored,  &Impl::list_worlds},
        {"/worlds/picture/*", core::Methods::read, everybody,              Upgrade::ignored,  &Impl::world_picture},
        {"/worlds/list",  core::Methods::post, everybody,                  Upgrade::ignored,  &Impl::no_folder},
        {"/ticket*",      core::Methods::get,  &Impl::has_ticket,          Upgrade::accepted, &Impl::client_without_upgrade},
        // Without a token nothing is found, whatever the method.
        {"/simulation/*", core::Methods::read, &Impl::leads_to_simulation, Upgrade::ignored,  &Impl::forward},
        // clang-format on
    });
    return table;
}

/// People who have typed the address of the machine are led to what it has for them; programs, such as health
/// checks, are answered as by a session server.
Answer SimulationService::Impl::front_page(IncomingRequest const& request)
{
    bool const is_person = request.header("Accept").find("text/html") != std::string_view::npos;
    auto response =
        is_person ? HttpResponse(302, {}, {}) : core::page(status.takes_simulations() ? "1" : "0");
    if (is_person)
        response.headers.emplace_back("Location", "monitor"); // relative, for proxies that rewrite paths
    response.headers.emplace_back("Vary", "Accept");
    return response;
}

Answer SimulationService::Impl::client_without_upgrade(IncomingRequest const& request)
{
    return upgrade_wanted(context.log, request);
}

Answer SimulationService::Impl::world_picture(IncomingRequest const& request)
{
    constexpr std::string_view folder = "/worlds/picture/";
    return pictures.answer(request.path.substr(folder.size()), request.header("If-None-Match"));
}

/// Answers a request that has no body; `respond_to_body` answers the others.
Answer SimulationService::Impl::no_folder(IncomingRequest const&)
{
    return core::json_page(core::world_list_error(core::refused(core::Refused::address_without_folder)));
}

bool SimulationService::Impl::has_ticket(IncomingRequest const& request) const
{
    return !core::ticket_in(request.path).empty();
}

/// Why a browser could not be told how it reaches its simulation; nothing: it can. Its session server's
/// gateway is asked for: the log says what is wrong.
std::optional<Failure> SimulationService::Impl::refuse_way(ChannelInfo const& info) const
{
    std::string_view problem;
    if (!info.is_from_proxy)
        problem = "add it to \"trustedProxies\"";
    else if (!core::parse_public_base(info.public_address))
        problem = "what it says of itself makes no sense";
    else if (!context.launcher.config().gateway)
        problem = "set \"gateway\" to true";
    if (info.public_address.empty() || problem.empty())
        return std::nullopt;
    context.log.warning(LogCause("gateway"),
                        concat("A browser that came through the gateway of a session server at ", info.peer,
                               " would not reach its simulation: ", problem));
    return core::refused(core::Refused::no_way_through_gateway);
}

/// Whether the browser may start a simulation; otherwise it is told why not.
bool SimulationService::Impl::admit(std::uint64_t id, ChannelInfo const& info,
                                    core::SimulationRequest const& request, Channel& channel)
{
    auto why = refuse_way(info);
    if (!why && hooks.refuse_ticket)
        why = hooks.refuse_ticket(core::ticket_in(info.path));
    if (!why)
        return true;
    context.log.warning(LogCause("ticket"), concat("[", std::to_string(id), "] Refused: ", why->message()));
    if (core::is_relayed(request))
        (void)channel.send(std::string(core::refusal_message(core::StartRefusal::here)));
    tell(channel, *why, core::wants_reasons(request));
    return false;
}

/// Whether simulations are staged for this client: for a session server, with a ticket if we want one. What
/// comes through a session server's gateway is a browser.
bool SimulationService::Impl::may_stage(ChannelInfo const& info, Channel& channel)
{
    std::optional<Failure> why;
    if (!info.public_address.empty())
        why = core::refused(core::Refused::wrong_message,
                            {{"words", "only session servers have simulations staged"}});
    else if (hooks.refuse_ticket)
        why = hooks.refuse_ticket(core::ticket_in(info.path));
    if (why)
        tell(channel, *why, false);
    return !why;
}

/// Null: there is no simulation with such a token and port.
SimulationGateway const* SimulationService::Impl::simulation_at(core::GatewayPath const& path) const
{
    for (auto const& [id, session] : sessions)
        if (session->gateway().is_at(path.token))
            return session->gateway().has_port(path.port) ? &session->gateway() : nullptr;
    return nullptr;
}

bool SimulationService::Impl::leads_to_simulation(IncomingRequest const& request) const
{
    auto const path = core::parse_gateway_path(request.path);
    return path && simulation_at(*path);
}

/// Asked only where the request leads to a simulation.
Answer SimulationService::Impl::forward(IncomingRequest const& request)
{
    auto const path = core::parse_gateway_path(request.path);
    auto const& simulation = *simulation_at(*path);
    if (simulation.is_editors(path->port) && !request.header(core::untrusted_header).empty())
        return HttpResponse(403, std::string(core::html_type),
                            "The editor would have the origin of the session server's pages, which only "
                            "those of trusted machines may: its operator can "
                            "add \"trusted\": true to this machine in \"simulationServers\".");
    return simulation.forward(*path, request);
}

result<ControllerWay> SimulationService::way_of_controller(std::uint16_t, std::string_view key,
                                                           std::string_view robot)
{
    for (auto const& [id, session] : impl_->sessions)
        if (session->gateway().has_controller_key(key))
            return session->gateway().way_of_controller(robot);
    return Failure(errc::refused,
                   "There is no simulation with this key, or it has ended: take the address that "
                   "the console of the simulation shows.");
}

asio::awaitable<void> SimulationService::serve_websocket(ChannelInfo info, Channel& channel)
{
    if (StatusEndpoints::serves(info.path))
        co_return co_await impl_->status.watch(channel);
    ++impl_->clients;
    auto const id = ++impl_->last_id;
    auto const name = concat("[", std::to_string(id), "] ");
    impl_->context.log.info(LogCause("client"), concat(name, "New client", core::of_client(info.client)));
    // Until it asks for something, it may be closed in favour of others (`add_silent`).
    impl_->add_silent(id, info.quota_key, channel);
    auto first = co_await impl_->receive_request(id, channel);
    impl_->remove_silent(id);
    auto* const request = std::get_if<core::SimulationRequest>(&first);
    if (request && impl_->admit(id, info, *request, channel))
        co_await impl_->simulate(id, std::move(info), std::move(*request), channel);
    else if (auto const* reconnect = std::get_if<core::ReconnectMessage>(&first))
        co_await impl_->reconnect(id, std::move(info), reconnect->token, channel);
    else if (auto* stage = std::get_if<core::StageMessage>(&first); stage && impl_->may_stage(info, channel))
        co_await impl_->stager.serve(id, std::move(stage->wishes), channel);
    // Only now: while the simulation waits for its browser to return, this connection still stands for it.
    --impl_->clients;
    impl_->context.log.info(LogCause("client"), concat(name, "Client disconnected"));
}

void SimulationService::stopping()
{
    impl_->stop();
}

void SimulationService::Impl::stop()
{
    context.state.stop();
    repositories.stop();
    for (auto const& [id, session] : sessions)
        session->on_server_stop();
}

/// Idle connections keep nobody out: the oldest of them is closed when there are too many.
void SimulationService::Impl::add_silent(std::uint64_t id, std::string const& quota_key, Channel& channel)
{
    auto const evicted = context.admission.add_silent(id, quota_key);
    silent_channels.emplace(id, &channel);
    if (!evicted)
        return;
    context.log.warning(LogCause("waiting limit"),
                        concat("More than ", std::to_string(config.max_silent), " connections, or ",
                               std::to_string(config.silent_per_address),
                               " of one address, start nothing: the oldest, [", std::to_string(*evicted),
                               "], is closed"));
    auto* const oldest = silent_channels.at(*evicted);
    // Its coroutine removes it again when it has ended, which does no harm.
    silent_channels.erase(*evicted);
    tell(*oldest, core::refused(core::Refused::too_many_silent), false);
    oldest->close();
}

void SimulationService::Impl::remove_silent(std::uint64_t id)
{
    context.admission.remove_silent(id);
    silent_channels.erase(id);
}

asio::awaitable<FirstRequest> SimulationService::Impl::receive_request(std::uint64_t id, Channel& channel)
{
    auto& clock = context.clock;
    auto const deadline = clock.now() + config.handshake_timeout;
    for (;;) {
        auto const text = co_await async::with_deadline(clock, deadline, channel.receive());
        if (!text && text.error() == errc::timed_out)
            tell(channel, core::refused(core::Refused::nothing_asked), false);
        if (!text)
            co_return FirstRequest();
        auto message = core::parse_client_message(*text);
        if (auto* request = std::get_if<core::SimulationRequest>(&message))
            co_return std::move(*request);
        if (auto* reconnect = std::get_if<core::ReconnectMessage>(&message))
            co_return std::move(*reconnect);
        if (auto* stage = std::get_if<core::StageMessage>(&message))
            co_return std::move(*stage);
        // A message that needs a simulation is no reason to give up: the browser may still ask for one until
        // the deadline.
        if (std::holds_alternative<core::ResetControllerMessage>(message) ||
            std::holds_alternative<core::ReadFileMessage>(message) ||
            std::holds_alternative<core::WriteFileMessage>(message) ||
            std::holds_alternative<core::CompileMessage>(message))
            tell(channel, core::refused(core::Refused::no_start_to_reset), false);
        if (std::holds_alternative<core::ExtendMessage>(message))
            tell(channel, core::refused(core::Refused::no_start_to_extend), false);
        if (auto const* malformed = std::get_if<core::MalformedMessage>(&message)) {
            context.log.warning(LogCause("message"),
                                concat("[", std::to_string(id), "] Malformed message: ", malformed->reason));
            tell_wrong_message(channel, malformed->reason, false);
            co_return FirstRequest();
        }
    }
}

asio::awaitable<void> SimulationService::Impl::simulate(std::uint64_t id, ChannelInfo info,
                                                        core::SimulationRequest request, Channel& channel)
{
    auto const executor = co_await asio::this_coro::executor;
    // One that is ready spares the browser the wait.
    auto session = co_await stager.take(info.quota_key, request);
    bool const is_ready = session != nullptr;
    if (is_ready) {
        context.log.info(LogCause("staged"), concat("[", std::to_string(id), "] Gets the staged simulation ",
                                                    std::to_string(session->id())));
    } else {
        session = std::make_shared<SimulationSession>(context, executor, id, std::move(info.quota_key),
                                                      std::move(request));
        sessions.emplace(id, session);
    }
    // Before it runs: what `run` and `resume` send has an address that this browser can reach.
    session->gateway().set_asked(std::move(info.asked), std::move(info.public_address));
    if (is_ready)
        co_await session->resume(channel);
    else
        co_await session->run(channel);
    forget_if_over(*session);
}

void SimulationService::Impl::forget_if_over(SimulationSession const& session)
{
    if (!session.is_over())
        return;
    // Refusals cost next to nothing, and must not have pages made anew.
    if (session.stage() != core::SimulationLife::Stage::fetching)
        ++context.changes;
    sessions.erase(session.id());
}

std::shared_ptr<SimulationSession> SimulationService::Impl::find_session(std::string_view token) const
{
    auto const found = std::find_if(sessions.begin(), sessions.end(), [&](auto const& entry) {
        return !token.empty() && entry.second->token() == token;
    });
    return found == sessions.end() ? nullptr : found->second;
}

asio::awaitable<void> SimulationService::Impl::reconnect(std::uint64_t id, ChannelInfo info,
                                                         std::string token, Channel& channel)
{
    auto const session = find_session(token);
    bool taken = false;
    if (session)
        taken = co_await session->take_over();
    if (!taken) {
        tell(channel, core::refused(core::Refused::has_ended), true); // whoever has a token knows what we add
        co_return;
    }
    context.log.info(LogCause("return"), concat("[", std::to_string(id), "] Returned to simulation ",
                                                std::to_string(session->id())));
    // The browser may come another way than before. What it comes with about that counts only from a proxy
    // that we trust.
    bool const is_told = info.is_from_proxy && core::parse_public_base(info.public_address);
    session->gateway().set_asked(std::move(info.asked),
                                 is_told ? std::move(info.public_address) : std::string());
    co_await session->resume(channel);
    forget_if_over(*session);
}

} // namespace webots_cloud
