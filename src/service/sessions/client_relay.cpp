// What the session server does with a browser on /client until it is known what it wants.
// client_relay_line.cpp has those who wait, client_relay_ride.cpp the way to a machine and the relaying
// there.
// Decisions: core/access/silent_clients, core/relay/relay_messages, core/waiting/waiting_room.
#include "client_relay_browser.hpp"

#include "core/refusals.hpp"
#include "core/relay/relay_messages.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"
#include "service/tell.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <string_view>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// As on a simulation server, whose place we take.
constexpr auto first_message_timeout = std::chrono::seconds(30);
constexpr std::size_t max_silent = 1000;
constexpr std::size_t max_silent_per_client = 100;

// Requests of those who wait are kept: all short ones, and long ones (`init` lists files) up to this many
// bytes together.
constexpr std::size_t short_request = 4096;
constexpr std::size_t max_kept = 16 * 1024 * 1024;

// After a start names have to be looked up, and machines announce themselves every ten seconds.
constexpr Duration all_found = std::chrono::seconds(15);

constexpr std::uint16_t try_again_later = 1013; // as in the registry of RFC 6455

} // namespace

ClientRelay::ClientRelay(SiteContext const& site, ClassEndpoint& classes, SessionEndpoint& sessions,
                         SiteAvailability& availability)
    : site_(site), classes_(classes), sessions_(sessions), availability_(availability),
      silent_(max_silent, max_silent_per_client), waits_({1, 5, 15, 60, 300, 900, 3600}),
      began_(site.clock.now())
{
    apply();
}

ClientRelay::~ClientRelay() = default;

void ClientRelay::apply()
{
    core::WaitingRoomParams room;
    room.places = static_cast<std::size_t>(site_.config.service.waiting_room);
    room_.apply(room);
}

void ClientRelay::put(FleetMachine const& machine, FleetMachine const*, std::optional<std::string_view>)
{
    machines_.try_emplace(machine.spec.address);
}

void ClientRelay::remove(FleetMachine const& machine)
{
    auto const& entry = machine.spec.address;
    machines_.erase(entry);
    faults_.forget(entry);
    questions_.forget(entry);
}

/// Not a coroutine itself, as its frame would cost memory for every browser that waits.
asio::awaitable<void> ClientRelay::serve(ChannelInfo info, Channel& channel)
{
    auto const id = ++last_id_;
    auto& browser = browsers_.try_emplace(id, id, channel).first->second;
    browser.asked = std::move(info.asked);
    browser.client = std::move(info.client);
    browser.waits_since = site_.clock.now();
    if (auto const oldest = silent_.enter(id, info.quota_key))
        refuse(browsers_.at(*oldest), core::Refused::too_many_silent);
    if (silent_.size() == 1 && line_changed_)
        line_changed_->notify(); // `run` has to look after it
    return talk(browser);
}

asio::awaitable<void> ClientRelay::talk(Browser& browser)
{
    if (!tasks_)
        tasks_.emplace(co_await asio::this_coro::executor);
    for (;;) {
        auto message = co_await browser.channel.receive();
        if (!message) {
            co_await leave(browser, message.error());
            break;
        }
        take(browser, std::move(*message));
    }
    auto const id = browser.id; // not a reference into what is erased
    browsers_.erase(id);
}

void ClientRelay::take(Browser& browser, std::string text)
{
    if (!std::exchange(browser.has_spoken, true))
        take_first(browser, std::move(text), silent_.leave(browser.id));
    else if (browser.ride && browser.ride->is_known)
        pass_on(browser, std::move(text));
}

/// Those who have not asked for anything in time.
void ClientRelay::drop_silent(TimePoint now)
{
    for (auto oldest = silent_.first(); oldest && now >= end_of_silence(*oldest); oldest = silent_.first()) {
        (void)silent_.leave(*oldest);
        refuse(browsers_.at(*oldest), core::Refused::nothing_asked);
    }
}

TimePoint ClientRelay::end_of_silence(Id silent) const
{
    return browsers_.at(silent).waits_since + first_message_timeout;
}

void ClientRelay::refuse(Browser& browser, Failure const& why)
{
    tell(browser.channel, why, browser.options.wants_reasons);
    browser.channel.close();
}

void ClientRelay::refuse(Browser& browser, core::Refused why)
{
    refuse(browser, core::refused(why));
}

void ClientRelay::take_first(Browser& browser, std::string text, std::string const& quota_key)
{
    auto const message = core::parse_client_message(text);
    browser.options = core::relay_options(text);
    if (auto const* request = std::get_if<core::SimulationRequest>(&message)) {
        if (core::is_fetch_only(*request))
            return refuse(browser, core::Refused::fetch_at_relay);
        return begin(browser, std::move(text), quota_key);
    }
    if (auto const* reconnect = std::get_if<core::ReconnectMessage>(&message))
        return come_back(browser, reconnect->token, quota_key);
    if (auto const* malformed = std::get_if<core::MalformedMessage>(&message))
        return refuse(browser, core::refused(core::Refused::wrong_message, {{"words", malformed->reason}}));
    refuse(browser, core::Refused::nothing_to_relay);
}

/// A browser asks for a simulation.
void ClientRelay::begin(Browser& browser, std::string text, std::string const& quota_key)
{
    if (!sessions_.may_ask(quota_key, site_.clock.now()))
        return refuse(browser, core::Refused::too_many_starts);
    auto const now = site_.clock.now();
    browser.request = std::move(text);
    ask_for_seat(browser);
    if (browser.seat == core::SeatRequest::too_often)
        return refuse(browser, core::Refused::too_many_starts);
    browser.group = group_of(browser, quota_key);
    browser.waits_since = now;
    browser.rank = site_.clock.wall();
    // After group and rank, which a good ticket replaces by those that the browser had before.
    claim_ticket(browser);
    auto request = request_of(browser, now);
    browser.world = world_key(request.world, request.mode).world;
    // Those who wait are passed only where all of them wait for more room than this one is known to need.
    bool const may_go = room_.params().places == 0 || !is_settling(now);
    bool const passes_others = room_.size() == want_room_ && !is_known_to_be_too_large(browser, now);
    if (browser.seat != core::SeatRequest::held && !(may_go && passes_others))
        return line_up(browser, now);
    request.current_since = now - relay::current_report;
    // Other session servers may have placed somebody since the last reports, so the best machines are asked
    // first. The browser has a ride meanwhile, by which `leave` can cancel that.
    auto asked = ask_machines(browser, request, now);
    if (asked.empty())
        return serve_now(browser, request, now);
    browser.ride = std::make_unique<Ride>(tasks_->executor());
    browser.ride->task = tasks_->spawn(serve_when_answered(browser, std::move(asked), request.current_since));
}

/// What a student may have; it changes while one waits, as others of the class come and go.
void ClientRelay::ask_for_seat(Browser& browser)
{
    if (auto const& student = browser.options.student; !student.empty())
        browser.seat = classes_.ask_for_seat(student, site_.clock.now());
}

void ClientRelay::serve_now(Browser& browser, PlacementRequest const& request, TimePoint now)
{
    if (!try_to_place(browser, request, now))
        return line_up(browser, now);
    waits_.add(0);
    start_carrying(browser);
}

void ClientRelay::line_up(Browser& browser, TimePoint now)
{
    if (room_.params().places == 0)
        return refuse(browser, core::Refused::no_machine_to_relay);
    if (browser.request.size() > short_request && kept_ + browser.request.size() > max_kept)
        return refuse(browser, core::Refused::no_machine_to_relay);
    if (wait_in_line(browser, now) && !is_settling(now))
        give_out_seats(now);
}

/// A browser returns to its simulation.
void ClientRelay::come_back(Browser& browser, std::string_view text, std::string const& quota_key)
{
    auto const token = core::parse_relayed_token(text);
    bool const is_known = token && machines_.contains(token->entry);
    // The machine may not have been found yet since our start: the browser is to come again, not to give up.
    if (token && !is_known && site_.finds_machines() && site_.clock.now() - began_ < all_found)
        return browser.channel.close(relay::service_restart);
    browser.options.wants_reasons = true; // whoever has a token knows what we add
    if (!is_known)
        return refuse(browser, core::Refused::has_ended);
    if (!sessions_.may_ask(quota_key, site_.clock.now()))
        return browser.channel.close(try_again_later);
    browser.options.can_return = true;
    browser.options.wants_heartbeat = true;
    browser.group = group_of(browser, quota_key);
    browser.ride = std::make_unique<Ride>(tasks_->executor());
    browser.ride->entry = token->entry;
    browser.ride->opening = core::reconnect_message(token->token);
    start_carrying(browser);
}

/// The browser has left.
asio::awaitable<void> ClientRelay::leave(Browser& browser, Failure const& why)
{
    browser.has_left = true;
    (void)silent_.leave(browser.id);
    given_up_ += leave_line(browser) ? 1 : 0;
    if (browser.ticket)
        tickets_.leave(*browser.ticket, browser.id, site_.clock.wall());
    if (!browser.ride)
        co_return;
    auto& ride = *browser.ride;
    bool const is_lost = why == errc::unreachable || is_stopping_;
    if (!is_lost && ride.machine) // it ends the simulation at once; otherwise after the grace
        ride.machine->close(browser.channel.farewell());
    if (ride.task)
        async::TaskGroup::cancel(*ride.task);
    // The task uses the browser, which is erased once we return.
    while (ride.task)
        (void)co_await ride.changed.wait();
}

void ClientRelay::update()
{
    give_out_seats(site_.clock.now());
}

void ClientRelay::stop()
{
    is_stopping_ = true;
    for (auto& [id, browser] : browsers_)
        browser.channel.close(relay::service_restart);
}

core::WaitingFigures ClientRelay::figures() const
{
    core::WaitingFigures figures;
    figures.waiting = room_.size();
    figures.relayed = relayed_;
    constexpr std::size_t first = 100; // those behind them have come later, but for some minutes
    auto const now = site_.clock.now();
    core::WaitCounts reasons{};
    for (std::size_t ahead = 0; ahead < std::min(first, room_.size()); ++ahead) {
        auto const& browser = browser_at(ahead);
        figures.longest = std::max(figures.longest, now - browser.waits_since);
        ++reasons[static_cast<std::size_t>(browser.told_why)];
    }
    for (auto const why : core::all_wait_reasons)
        if (auto const count = reasons[static_cast<std::size_t>(why)]; count > 0)
            figures.reasons.emplace_back(core::word_of(why), count);
    return figures;
}

void ClientRelay::write_metrics(core::MetricsText& text) const
{
    text.family(core::metric("waiting")).add(static_cast<double>(room_.size()));
    text.family(core::metric("waiting_max")).add(static_cast<double>(room_.params().places));
    text.family(core::metric("waiting_longest_seconds"))
        .add(std::chrono::duration<double>(figures().longest).count());
    text.family(core::metric("waiting_seconds")).add(waits_);
    text.family(core::metric("waiting_given_up_total")).add(static_cast<double>(given_up_));
    text.family(core::metric("waiting_refused_total")).add(static_cast<double>(refused_));
    text.family(core::metric("relayed")).add(static_cast<double>(relayed_));
    text.family(core::metric("relay_questions_total")).add(static_cast<double>(questions_asked_));
    text.family(core::metric("relay_attempts_total"));
    for (auto const& [outcome, count] : attempts_)
        text.add(static_cast<double>(count), {{"result", outcome}});
}

} // namespace webots_cloud
