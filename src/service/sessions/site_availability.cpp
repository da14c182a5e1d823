// Decisions: core/site_state.
#include "site_availability.hpp"

#include "core/pages/http_pages.hpp"
#include "core/text.hpp"

#include <string>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

core::SiteState SiteAvailability::state_with(std::size_t waiting, bool is_available, TimePoint now) const
{
    auto const& config = site_.config.service;
    core::SiteFacts facts;
    facts.is_available = is_available;
    facts.can_wait = config.relay && config.waiting_room > 0;
    facts.waiting = waiting;
    if (core::depends_on_machines(facts)) {
        facts.machines = site_.scheduler.refusals(now);
        // While one machine has reported, there is mostly no need to count.
        auto const unheard = facts.machines[static_cast<std::size_t>(Refusal::unknown)];
        facts.is_awaited = unheard > 0 && !facts.is_available && site_.monitor.totals().unknown > 0;
    }
    return core::site_state(facts);
}

core::SiteState SiteAvailability::supply(TimePoint now) const
{
    return state_with(0, site_.scheduler.available(now), now);
}

bool SiteAvailability::takes_more(TimePoint now) const
{
    auto const places = static_cast<std::size_t>(site_.config.service.waiting_room);
    return places > 0 ? waiting_ < places : site_.scheduler.available(now);
}

void SiteAvailability::note_line(std::size_t waiting)
{
    waiting_ = waiting;
    update(site_.clock.now());
}

void SiteAvailability::update(TimePoint now)
{
    bool const is_available = site_.scheduler.available(now);
    if (auto const state = state_with(waiting_, is_available, now); state != state_) {
        state_ = state;
        for (auto* const browser : state_browsers_)
            (void)browser->send(std::string(core::word_of(state_)));
    }
    if (is_available == is_available_)
        return;
    is_available_ = is_available;
    // A channel whose queue is full closes itself; its own coroutine then removes it from the set.
    for (auto* const browser : browsers_)
        (void)browser->send(is_available_ ? "1" : "0");
}

Answer SiteAvailability::answer(IncomingRequest const& request, std::string_view start_page) const
{
    auto response = core::page(is_available_ ? "1" : "0");
    if (request.header("Accept").find("text/html") != std::string_view::npos) {
        response = HttpResponse(302, {}, {});
        response.headers.emplace_back("Location", start_page);
    }
    response.headers.emplace_back("Vary", "Accept");
    return response;
}

asio::awaitable<void> SiteAvailability::serve(ChannelInfo info, Channel& channel)
{
    auto const name = core::concat("[", core::printable(info.asked.host, 100), "] ");
    site_.log.info(LogCause("client"), core::concat(name, "New client", core::of_client(info.client)));
    bool const wants_state = info.query == "state";
    auto& watchers = wants_state ? state_browsers_ : browsers_;
    watchers.insert(&channel);
    (void)channel.send(wants_state ? std::string(core::word_of(state_)) : is_available_ ? "1" : "0");
    for (;;) {
        auto const message = co_await channel.receive();
        if (!message)
            break;
        site_.log.info(LogCause("message", info.client),
                       core::concat(name, "Ignored client message: ", core::printable(*message)));
    }
    watchers.erase(&channel);
    site_.log.info(LogCause("client"), core::concat(name, "Client disconnected"));
}

void SiteAvailability::write_metrics(core::MetricsText& text) const
{
    text.family(core::metric("available")).add(is_available_ ? 1 : 0);
    text.family(core::metric("site_state"));
    for (auto const each : core::all_site_states)
        text.add(each == state_ ? 1 : 0, {{"state", core::word_of(each)}});
    text.family(core::metric("availability_watchers"))
        .add(static_cast<double>(browsers_.size() + state_browsers_.size()));
}

} // namespace webots_cloud
