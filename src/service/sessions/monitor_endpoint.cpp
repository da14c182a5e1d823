// Decisions: core/site_state.
#include "monitor_endpoint.hpp"

#include "core/pages/http_pages.hpp"
#include "core/pages/monitor_page.hpp"
#include "core/site_state.hpp"

#include <functional>

namespace webots_cloud {
namespace {

/// A page with more would be so large that others would notice while it is made; its script asks for them.
constexpr std::size_t max_machines_in_page = 500;

} // namespace

MonitorEndpoint::MonitorEndpoint(SiteContext const& site, ClientRelay const& relay,
                                 SiteAvailability const& availability)
    : site_(site), relay_(relay), availability_(availability), started_(site.clock.wall()),
      board_(site.monitor.params().interval, site.monitor.params().threshold)
{
    apply();
}

void MonitorEndpoint::apply()
{
    core::SessionAbout about;
    about.started = started_;
    about.is_tls = site_.config.address.ssl;
    about.is_gateway = site_.config.service.gateway;
    about.shows_decisions = site_.config.service.decisions_for_all;
    board_.describe(core::about_json(about));
    board_.set_threshold(site_.monitor.params().threshold);
}

void MonitorEndpoint::put(FleetMachine const& machine, FleetMachine const* was,
                          std::optional<std::string_view> before)
{
    board_.put(*site_.monitor.find(machine.spec.address), machine, was, before);
}

void MonitorEndpoint::expire()
{
    html_.expire();
    json_.expire();
    greeting_ = {};
}

/// Asks for all that machines and browsers don't tell when it changes.
void MonitorEndpoint::look()
{
    auto& scheduler = site_.scheduler;
    board_.count_placed(std::bind_front(&Scheduler::placed, &scheduler));
    board_.note_states([&scheduler, now = site_.clock.now()](ServerLoad const& server) {
        return core::machine_state(scheduler.refusal_of(server.address, now),
                                   server.state == ServerState::unknown);
    });
    board_.note_refusals(std::bind_front(&ClientRelay::last_refusal, &relay_));
    board_.note_site(availability_.state());
    board_.note_waiting(site_.config.service.relay ? std::optional(relay_.figures()) : std::nullopt);
}

std::string MonitorEndpoint::snapshot()
{
    look();
    return board_.snapshot();
}

void MonitorEndpoint::update()
{
    auto const now = site_.clock.now();
    greeting_ = {};
    if (!feed_.empty() || board_.ends_minute(now))
        look();
    board_.take(now, site_.clock.wall());
    if (feed_.empty())
        return;
    if (auto const update = board_.update(); !update.empty())
        feed_.publish(update);
}

Answer MonitorEndpoint::answer(IncomingRequest const& request)
{
    auto const now = site_.clock.now();
    auto const known = request.header("If-None-Match");
    // Asked by a page behind a proxy that blocks WebSockets.
    if (request.header("Accept").starts_with("application/json"))
        return json_.get(now, [this] { return snapshot(); }).answer("application/json", known);
    return html_.get(now, [this] { return page(); }).answer(core::html_type, known);
}

std::string MonitorEndpoint::page()
{
    auto const machines = site_.fleet.machines().size();
    core::MonitorPage page;
    page.title = "Webots session server";
    page.words = core::session_words(started_, machines, site_.monitor.totals());
    if (machines <= max_machines_in_page)
        page.snapshot = snapshot();
    page.assets = monitor_assets("session.js", site_.config.address.port);
    return core::monitor_page(page);
}

/// All who connect before the next update get the same text; what has changed since is in that update.
boost::asio::awaitable<void> MonitorEndpoint::serve(Channel& channel)
{
    if (greeting_.empty())
        greeting_ = snapshot();
    return feed_.serve(greeting_, channel);
}

} // namespace webots_cloud
