// A browser on its way to a machine, and there.
// Decisions: core/relay/machine_conversation, core/relay/machine_faults.
#include "client_relay_browser.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "core/access/asked_name.hpp"
#include "core/refusals.hpp"
#include "core/relay/relay_messages.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/public_base.hpp"
#include "core/text.hpp"
#include "machine_request.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;
using core::MachineRefusal;

namespace {

constexpr std::size_t max_said = 16 * 1024; // bytes of one browser, before there is a simulation
constexpr std::size_t max_failures = 3;     // at machines, of one browser
constexpr std::size_t max_full = 10;        // machines that turn out to be full, before a browser waits again

constexpr Duration longest_start = std::chrono::minutes(30); // on one machine, whatever it says
constexpr Duration pause_after_full = std::chrono::seconds(1);
// A machine that has refused a browser is asked by it again then: a disk may have been full.
constexpr Duration pause_after_refusal = std::chrono::minutes(1);
constexpr std::size_t longest_logged = 300; // bytes of a machine's sentence

constexpr std::uint16_t internal_error = 1011; // RFC 6455

std::string_view label_of(MachineRefusal refusal) noexcept
{
    switch (refusal) {
    case MachineRefusal::none:
        return "served";
    case MachineRefusal::full:
        return "full";
    case MachineRefusal::machine:
        return "refused";
    case MachineRefusal::needs:
        return "unsuitable";
    case MachineRefusal::silent:
        return "silent";
    }
    return {};
}

/// Codes with which simulation servers close; others are no business of a machine's.
bool is_for_browsers(std::uint16_t close_code) noexcept
{
    constexpr std::uint16_t normal = 1000;
    return close_code == 0 || close_code == normal || close_code == core::taken_over_code;
}

} // namespace

/// To the machine. A browser that says much before there is a simulation, or more than the machine takes, is
/// to blame itself, and not the machine.
void ClientRelay::pass_on(Browser& browser, std::string message)
{
    auto& ride = *browser.ride;
    ride.said += ride.is_ready ? 0 : message.size();
    bool const is_greedy = ride.said > max_said || !ride.machine->send(std::move(message));
    if (!is_greedy)
        return;
    ride.is_at_fault = true;
    refuse(browser, core::Refused::page_says_too_much);
}

/// Finds a machine, where the browser goes next.
/// Errors: `unavailable`; `refused`: there is no machine that could ever run this.
result<> ClientRelay::try_to_place(Browser& browser, PlacementRequest const& request, TimePoint now)
{
    auto const placement = find_machine(request, now);
    if (!placement)
        return placement.error();
    if (!browser.ride)
        browser.ride = std::make_unique<Ride>(tasks_->executor());
    auto& ride = *browser.ride;
    ride.entry = placement->address;
    ride.opening = core::request_for_machine(browser.request);
    ride.placement = *placement;
    ride.is_placed = ride.is_unclaimed = true;
    if (browser.seat != core::SeatRequest::unknown)
        classes_.take_seat(browser.options.student, browser.seat, ride.entry, browser.asked, now);
    return {};
}

PlacementRequest ClientRelay::request_of(Browser const& browser, TimePoint now) const
{
    auto const message = core::parse_client_message(browser.request);
    auto const& asked = std::get<core::SimulationRequest>(message);
    PlacementRequest request;
    request.world = core::world_of(asked);
    if (auto const* start = std::get_if<core::StartMessage>(&asked))
        request.mode = start->mode;
    request.held = browser.seat == core::SeatRequest::held;
    request.only_free = room_.params().places > 0;
    request.must_fit = must_fit(browser, now);
    request.excluded = faults_.silent(now);
    if (auto const* refusals = browser.refusals.get()) {
        request.labels = refusals->needs;
        for (auto const& refuser : refusals->refusers)
            if (now < refuser.until)
                request.excluded.push_back(refuser.entry);
        request.excluded.insert(request.excluded.end(), refusals->full.begin(), refusals->full.end());
    }
    return request;
}

result<Placement> ClientRelay::find_machine(PlacementRequest const& request, TimePoint now)
{
    auto const for_last = faults_.unwilling();
    if (for_last.empty())
        return site_.scheduler.place(request, now);
    // Machines that refuse come last, but they do come: projects of strangers can bring that about.
    auto first = request;
    first.excluded.insert(first.excluded.end(), for_last.begin(), for_last.end());
    if (auto placement = site_.scheduler.place(first, now))
        return placement;
    return site_.scheduler.place(request, now);
}

void ClientRelay::start_carrying(Browser& browser)
{
    ++relayed_;
    held_.add(browser.group);
    if (browser.ride->is_placed)
        sessions_.note_placement(true, site_.clock.now());
    if (browser.ticket)
        tickets_.serve(*std::exchange(browser.ticket, std::nullopt), browser.id, site_.clock.wall());
    browser.next_ticket = TimePoint::min();
    browser.was_seated = true;
    browser.ride->task = tasks_->spawn(carry(browser));
}

asio::awaitable<void> ClientRelay::carry(Browser& browser)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    bool const goes_back = co_await carry_to_end(browser);
    auto& ride = *browser.ride;
    // Whatever counts this browser at the machine is undone before it gets another one.
    ride.machine.reset();
    give_back(ride);
    --relayed_;
    held_.remove(browser.group);
    // There may be a free place now, of which those who wait are to know soon (`look_for_freed_seats`).
    if (auto const machine = machines_.find(ride.entry); machine != machines_.end())
        machine->second.freed = site_.clock.now();
    if (goes_back && !browser.has_left) {
        browser.ride.reset(); // this task's own; the browser may get another one at once
        if (wait_in_line(browser, site_.clock.now()))
            give_out_seats(site_.clock.now());
        co_return;
    }
    ride.task.reset();
    ride.changed.notify();
}

/// Until the simulation has ended, no machine takes it, or the browser has left. True: the browser waits
/// again.
asio::awaitable<bool> ClientRelay::carry_to_end(Browser& browser)
{
    auto& ride = *browser.ride;
    for (;;) {
        auto const refusal = co_await converse(browser);
        // Until another machine has the request, nobody is there to whom messages could be passed on.
        ride.is_known = false;
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled || browser.has_left || ride.is_at_fault)
            co_return false;
        if (refusal == MachineRefusal::none)
            co_return false;
        ++attempts_[label_of(refusal)];
        ride.machine.reset();
        note_refusal(browser, refusal);
        auto const next = try_again(browser);
        if (next != Next::another_machine)
            co_return next == Next::line;
        (void)browser.channel.send(core::loading_message("Trying another machine."));
    }
}

/// Nobody comes where the scheduler has placed the browser.
void ClientRelay::give_back(Ride& ride)
{
    if (!std::exchange(ride.is_unclaimed, false))
        return;
    auto placement = ride.placement;
    placement.address = ride.entry; // the scheduler may have forgotten the server by now, and its name
    site_.scheduler.release(placement, site_.clock.now());
}

void ClientRelay::note_refusal(Browser& browser, MachineRefusal refusal)
{
    auto& ride = *browser.ride;
    auto const now = site_.clock.now();
    if (!ride.is_placed) // it is not known whether the machine has any such simulation
        return;
    give_back(ride);
    auto& refusals = browser.refusals_so_far();
    if (refusal == MachineRefusal::full) {
        refusals.full.push_back(ride.entry);
        return;
    }
    if (refusal == MachineRefusal::silent) {
        ++refusals.failures;
        faults_.was_silent(ride.entry, now);
        site_.log.warning(LogCause("silent machine", ride.entry),
                          concat(ride.entry, " does not answer on /client as it should: ", ride.problem));
        return;
    }
    if (refusal == MachineRefusal::machine) {
        auto const why =
            core::printable(ride.problem.empty() ? refusals.last_word : ride.problem, longest_logged);
        faults_.has_refused(ride.entry, browser.group, why);
        site_.log.warning(LogCause("refused start", ride.entry),
                          concat(ride.entry, " refuses a start: ", why));
    }
    // One that refuses once more after its pause counts once.
    refusals.failures += refusals.is_by(ride.entry) ? 0 : 1;
    std::erase_if(refusals.refusers, [&](auto const& refuser) { return refuser.entry == ride.entry; });
    refusals.refusers.push_back({ride.entry, now + pause_after_refusal});
}

/// After a refusal.
ClientRelay::Next ClientRelay::try_again(Browser& browser)
{
    auto& ride = *browser.ride;
    if (!ride.is_placed) { // its simulation is there, or nowhere
        browser.channel.close(relay::service_restart);
        return Next::end;
    }
    // After a few failures the person is told, rather than kept waiting.
    auto& refusals = *browser.refusals;
    bool const is_patient = refusals.failures < max_failures;
    auto const now = site_.clock.now();
    auto const placed = is_patient && refusals.full.size() < max_full
                            ? try_to_place(browser, request_of(browser, now), now)
                            : result<>(Failure(errc::unavailable));
    if (placed)
        return Next::another_machine;
    if (placed.error() == errc::refused) {
        refuse(browser, placed.error());
        return Next::end;
    }
    if (room_.params().places > 0 && is_patient && may_be_taken(browser, now)) {
        // By its next turn they may have a place.
        refusals.full.clear();
        browser.not_before = now + pause_after_full;
        return Next::line;
    }
    tell_refusal(browser);
    return Next::end;
}

/// With the machine of the browser's ride, until it ends.
asio::awaitable<MachineRefusal> ClientRelay::converse(Browser& browser)
{
    auto& ride = *browser.ride;
    ride.problem.clear(); // of the machine before
    auto opened = co_await connect(browser);
    if (!opened) {
        ride.problem = opened.error().message();
        // A machine that answers may have a reason that concerns this client alone.
        co_return opened.error() == errc::protocol_error ? MachineRefusal::machine : MachineRefusal::silent;
    }
    ride.is_unclaimed = false; // from here on the machine counts it
    ride.machine = std::move(*opened);
    (void)ride.machine->send(ride.opening);
    ride.is_known = true;
    core::MachineConversation conversation(browser.options, ride.entry, is_ours(ride.entry));
    bool was_ready = false;
    auto ended = MachineRefusal::none;
    auto const latest = site_.clock.now() + longest_start;
    for (;;) {
        // A machine may report progress for ever: the browser is to have its chance at another one.
        if (!was_ready && site_.clock.now() > latest) {
            ride.problem = "it does not come to an end with a start";
            ended = MachineRefusal::silent;
            break;
        }
        auto message = co_await hear(*ride.machine, conversation.patience());
        if (!message) {
            ride.problem = message.error().message();
            ended = conversation.on_end();
            if (ended == MachineRefusal::none && !browser.has_left)
                end_browser(browser, message.error());
            break;
        }
        auto step = conversation.take(std::move(*message));
        if (!step.for_browser.empty())
            (void)browser.channel.send(std::move(step.for_browser));
        if (step.refusal != MachineRefusal::none) {
            ended = step.refusal;
            if (ended == MachineRefusal::needs)
                browser.refusals_so_far().needs = conversation.needs();
            // A person who waits for room at one machine wants to know why another one has refused.
            if (auto& refusals = browser.refusals_so_far();
                ended != MachineRefusal::full || refusals.last_word.empty()) {
                refusals.last_word = conversation.last_word();
                refusals.last_reason = conversation.last_reason();
            }
            break;
        }
        if (conversation.is_ready() && !was_ready)
            note_ready(browser);
        was_ready = conversation.is_ready();
    }
    if (was_ready)
        estimate_.session_ended(site_.clock.now());
    co_return ended;
}

/// The next message of a machine. Errors: as of Channel::receive; `timed_out`: it says nothing any more.
asio::awaitable<result<std::string>> ClientRelay::hear(Channel& machine, Duration patience)
{
    if (patience == Duration::max())
        return machine.receive();
    return async::with_deadline(site_.clock, site_.clock.now() + patience, machine.receive());
}

asio::awaitable<result<std::unique_ptr<Channel>>> ClientRelay::connect(Browser const& browser)
{
    auto const& ride = *browser.ride;
    auto const* const machine = site_.fleet.find(ride.entry);
    if (!machine)
        co_return Failure(errc::unreachable, "it was removed from \"simulationServers\"");
    auto const& internal = machine->spec.internal_address;
    auto const ticket = ride.is_placed ? site_.ticket_path(ride.entry) : std::string();
    auto request = machine_websocket(machine->spec, site_.config.address.ssl, concat(ticket, "/client"));
    // The machine answers with an address that this browser can reach, and counts for this browser.
    if (auto below_us = site_.addresses.address_below_us(ride.entry, browser.asked); !below_us.empty())
        request.headers.emplace_back(core::public_address_header, std::move(below_us));
    // One with a path of its own is called by the name that polls use.
    if (!internal.empty() && !machine->spec.has_own_path) {
        bool const has_name = !ride.entry.starts_with(core::asked_name);
        request.headers.emplace_back("Host", has_name ? std::string(authority_of_entry(ride.entry))
                                                      : browser.asked.host);
    }
    if (!browser.client.empty())
        request.headers.emplace_back("X-Forwarded-For", browser.client);
    co_return co_await site_.hooks.websockets->connect(std::move(request));
}

bool ClientRelay::is_ours(std::string_view entry) const
{
    auto const* const server = site_.monitor.find(entry);
    return server && server->report.arrivals.has_value();
}

void ClientRelay::note_ready(Browser& browser)
{
    auto& ride = *browser.ride;
    ride.is_ready = true;
    ride.opening = {};
    browser.request = {};
    ++attempts_[label_of(MachineRefusal::none)];
    faults_.has_served(ride.entry);
    estimate_.session_began(site_.clock.now());
}

/// The machine has ended the conversation.
void ClientRelay::end_browser(Browser& browser, Failure const& why)
{
    if (why != errc::closed)
        return browser.channel.close(relay::service_restart); // whoever can come back does
    auto const code = browser.ride->machine->farewell();
    browser.channel.close(is_for_browsers(code) ? code : internal_error);
}

} // namespace webots_cloud
