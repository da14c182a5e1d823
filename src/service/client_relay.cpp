#include "client_relay.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "core/access/asked_name.hpp"
#include "core/access/forwarding.hpp"
#include "core/relay/relay_messages.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"
#include "core/waiting/waiting_messages.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <set>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;
using core::MachineRefusal;

namespace {

// The same as of a simulation server, in whose place we are.
constexpr auto first_message_timeout = std::chrono::seconds(30);
constexpr std::size_t max_silent = 1000;
constexpr std::size_t max_silent_per_client = 100;

// Requests of those who wait are kept: short ones of all, and of long ones (`init` lists files) so many
// bytes.
constexpr std::size_t short_request = 4096;
constexpr std::size_t max_kept = 16 * 1024 * 1024;

constexpr std::size_t max_said = 16 * 1024; // bytes of one browser, before there is a simulation
constexpr std::size_t max_failures = 3;     // at machines, of one browser
constexpr std::size_t max_full = 10;        // machines that turn out to be full, before a browser waits again

constexpr Duration longest_start = std::chrono::minutes(30); // on one machine, whatever it says
constexpr Duration look_at_line = std::chrono::milliseconds(250);
constexpr Duration between_tellings = std::chrono::seconds(1);
constexpr Duration longest_silence = std::chrono::seconds(10); // towards those who wait
// A machine that has just ended a simulation is asked that often and for so long whether its place is free.
constexpr Duration freed_seat_poll = std::chrono::milliseconds(500);
constexpr Duration freed_seat_time = std::chrono::seconds(6);
constexpr Duration any_seat_poll = std::chrono::seconds(1); // of the others, in turn
constexpr std::size_t polls_at_once = 20;
constexpr Duration pause_after_full = std::chrono::seconds(1);
// After a start nobody has a turn at first, and then only who waited before: they come back about a second
// after they were lost, in no order.
constexpr Duration all_return = std::chrono::milliseconds(1200);
constexpr Duration return_first = std::chrono::seconds(2);

constexpr std::size_t told_at_once = 500; // browsers, before others have their turn
constexpr std::size_t max_wishes = 32;    // different ones, of those who want certain machines only

constexpr std::uint16_t try_again_later = 1013; // both as in the registry of RFC 6455
constexpr std::uint16_t internal_error = 1011;
constexpr std::uint16_t service_restart = 1012; // RFC 6455's registry: come back

constexpr std::string_view no_server = "No simulation server available at the moment.";
constexpr std::string_view group_full =
    "Too many wait here from your network already. Please try again in a moment.";
constexpr std::string_view too_many =
    "too many sessions are asked for from your network. Please try again in a moment.";

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

/// `host/2000` is reached at `host`, `host:2000` there.
std::string_view authority_of(std::string_view entry) noexcept
{
    return entry.substr(0, entry.find('/'));
}

} // namespace

struct ClientRelay::Machine
{
    Machine() = default;

    std::string internal_address;
    TimePoint freed{}; ///< When a simulation of ours has ended there.
    TimePoint polled{};
};

/// Of a browser on its way to a machine, or there.
struct ClientRelay::Ride
{
    explicit Ride(asio::any_io_executor const& executor) : ended(executor) {}

    std::string entry;
    std::string opening; ///< For the machine.
    Placement placement;
    bool is_placed = false;    ///< By the scheduler: it does not return.
    bool is_unclaimed = false; ///< The machine knows nothing of that.
    bool is_known = false;     ///< The machine has got the request.
    bool is_ready = false;
    bool is_at_fault = false; ///< The browser: nothing that happens says anything about the machine.
    std::size_t said = 0;     ///< Bytes of the browser, before there is a simulation.
    std::unique_ptr<Channel> machine;
    std::optional<async::TaskGroup::Task> task;
    async::Wakeup ended;
    std::string last_word; ///< Of the machine that refused last.
    std::string problem;   ///< Of the one that could not be reached.
};

/// A browser, from the handshake to the end of its connection. Those that wait are many: what only the others
/// need is in `Ride`.
struct ClientRelay::Browser
{
    Browser(Id number, Channel& browser) : id(number), channel(browser) {}

    Id id;
    Channel& channel;
    std::string host;
    std::string client;
    std::string quota_key;
    std::string request;
    core::RelayOptions options;
    std::string group;
    std::optional<WallTime> rank; ///< In the line.
    bool was_seated = false;
    bool is_in_line = false;
    bool came_back = false; ///< With a ticket.
    core::SeatRequest seat = core::SeatRequest::unknown;
    std::optional<core::WaitingTicket> ticket;
    TimePoint waits_since{};
    WallTime arrived{};
    TimePoint next_ticket = TimePoint::min();
    TimePoint told = TimePoint::min();
    TimePoint not_before = TimePoint::min();
    std::size_t told_ahead = 0;
    std::size_t failures = 0;
    std::vector<std::string> tried; ///< Machines that do not come into question any more,
    std::vector<std::string> full;  ///< or not at the moment.
    std::vector<std::string> needs;
    std::unique_ptr<Ride> ride;
    bool has_left = false;
};

ClientRelay::ClientRelay(ClientRelayParams params, LoadMonitor& monitor, Scheduler& scheduler, Clock& clock,
                         Logger log, ClientRelayHooks hooks)
    : params_(params), monitor_(monitor), scheduler_(scheduler), clock_(clock), log_(std::move(log)),
      hooks_(std::move(hooks)), silent_(max_silent, max_silent_per_client),
      waits_({1, 5, 15, 60, 300, 900, 3600}), began_(clock.now())
{
    apply(params_);
}

ClientRelay::~ClientRelay() = default;

void ClientRelay::apply(ClientRelayParams params)
{
    params_ = params;
    core::WaitingRoomParams room;
    room.places = params.waiting_places;
    room_.apply(room);
}

void ClientRelay::set_servers(std::vector<ServerSpec> const& servers)
{
    std::map<std::string, Machine, std::less<>> next;
    std::set<std::string, std::less<>> entries;
    for (auto const& server : servers) {
        auto const known = machines_.find(server.address);
        auto& machine = next[server.address];
        if (known != machines_.end())
            machine = known->second;
        machine.internal_address = server.internal_address;
        entries.insert(server.address);
    }
    machines_ = std::move(next);
    faults_.keep_only(entries);
}

bool ClientRelay::takes_more(TimePoint now) const
{
    return params_.waiting_places > 0 ? !room_.is_full() : scheduler_.available(now);
}

/// Not a coroutine itself, as its frame would cost memory for every browser that waits.
asio::awaitable<void> ClientRelay::serve(ChannelInfo info, Channel& channel)
{
    auto const id = ++last_id_;
    auto& browser = *browsers_.emplace(id, std::make_unique<Browser>(id, channel)).first->second;
    browser.host = std::move(info.host);
    browser.client = std::move(info.client);
    browser.quota_key = std::move(info.quota_key);
    return talk(browser);
}

asio::awaitable<void> ClientRelay::talk(Browser& browser)
{
    if (!tasks_)
        tasks_.emplace(co_await asio::this_coro::executor);
    auto message = co_await receive_first(browser);
    if (message)
        take_first(browser, std::move(*message));
    while (message) {
        message = co_await browser.channel.receive();
        if (message && browser.ride && browser.ride->is_known)
            pass_on(browser, std::move(*message));
    }
    co_await leave(browser, message.error());
    browsers_.erase(browser.id);
}

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
    refuse(browser, "This page says too much: please start again.");
}

/// The first message. Errors: as of Channel::receive; `timed_out`: there is none in time.
asio::awaitable<result<std::string>> ClientRelay::receive_first(Browser& browser)
{
    auto const id = browser.id;
    if (auto const oldest = silent_.enter(id, browser.quota_key))
        refuse(*browsers_.at(*oldest), "Too many connections wait here for their start: please start again.");
    auto text = co_await async::with_deadline(clock_, clock_.now() + first_message_timeout,
                                              browser.channel.receive());
    silent_.leave(id);
    if (!text && text.error() == errc::timed_out)
        refuse(browser, "No simulation was asked for in time: please start again.");
    co_return text;
}

void ClientRelay::refuse(Browser& browser, std::string_view sentence)
{
    (void)browser.channel.send(core::error_message(sentence));
    browser.channel.close();
}

void ClientRelay::take_first(Browser& browser, std::string text)
{
    auto const message = core::parse_client_message(text);
    if (auto const* request = std::get_if<core::SimulationRequest>(&message)) {
        if (core::is_fetch_only(*request))
            return refuse(browser, "A project can be fetched for later on a simulation server only.");
        return begin(browser, std::move(text));
    }
    if (auto const* reconnect = std::get_if<core::ReconnectMessage>(&message))
        return come_back(browser, reconnect->token);
    if (auto const* malformed = std::get_if<core::MalformedMessage>(&message))
        return refuse(browser, concat("Wrong message: ", malformed->reason, "."));
    refuse(browser, "The first message has to ask for a simulation.");
}

/// A browser asks for a simulation.
void ClientRelay::begin(Browser& browser, std::string text)
{
    if (hooks_.may_ask && !hooks_.may_ask(browser.quota_key))
        return refuse(browser, too_many);
    auto const now = clock_.now();
    browser.options = core::relay_options(text);
    browser.request = std::move(text);
    auto const& student = browser.options.student;
    if (!student.empty() && hooks_.ask_for_seat)
        browser.seat = hooks_.ask_for_seat(student);
    if (browser.seat == core::SeatRequest::too_often)
        return refuse(browser, too_many);
    browser.group = group_of(browser);
    browser.waits_since = now;
    browser.arrived = clock_.wall();
    claim_ticket(browser);
    bool const may_go = params_.waiting_places == 0 || !is_settling(now);
    bool const goes_first = browser.seat == core::SeatRequest::held || (room_.size() == 0 && may_go);
    if (goes_first && try_to_place(browser, now)) {
        waits_.add(0);
        return start_carrying(browser);
    }
    if (params_.waiting_places == 0)
        return refuse(browser, no_server);
    if (browser.request.size() > short_request && kept_ + browser.request.size() > max_kept)
        return refuse(browser, no_server);
    if (wait_in_line(browser, now) && !is_settling(now))
        give_out_seats(now);
}

/// Who waited before a restart comes back within a moment, and others are not served before.
bool ClientRelay::is_settling(TimePoint now) const
{
    return now - began_ < return_first;
}

/// Whose seats count together with this browser's; empty: nobody's, as behind a trusted proxy that names no
/// clients.
std::string ClientRelay::group_of(Browser const& browser) const
{
    auto key = browser.quota_key;
    if (auto const& student = browser.options.student; !student.empty() && hooks_.class_of)
        if (auto const of_class = hooks_.class_of(student); !of_class.empty())
            key = concat("class ", of_class);
    return hooks_.waiting_mac ? core::waiting_group(hooks_.waiting_mac, key) : key;
}

/// A browser returns to its simulation.
void ClientRelay::come_back(Browser& browser, std::string_view text)
{
    auto const token = core::parse_relayed_token(text);
    if (!token || !machines_.contains(token->entry))
        return refuse(browser, "This simulation has ended. Please start it again.");
    if (hooks_.may_ask && !hooks_.may_ask(browser.quota_key))
        return browser.channel.close(try_again_later);
    browser.options.can_return = true;
    browser.options.wants_heartbeat = true;
    browser.group = group_of(browser);
    browser.ride = std::make_unique<Ride>(tasks_->executor());
    browser.ride->entry = token->entry;
    browser.ride->opening = core::reconnect_message(token->token);
    start_carrying(browser);
}

/// False: it may not, and is told so.
bool ClientRelay::wait_in_line(Browser& browser, TimePoint now)
{
    using Verdict = core::WaitingRoom::Verdict;
    auto verdict = Verdict::waits;
    if (browser.was_seated) { // and the machine had no place
        room_.put_back(browser.id, browser.group, browser.rank.value_or(browser.arrived));
    } else if (browser.rank) { // of its ticket
        verdict = room_.return_to(browser.id, browser.group, *browser.rank);
    } else {
        auto const held = held_.find(browser.group);
        auto const seats = held == held_.end() ? 0 : held->second;
        auto const away = tickets_.away(browser.group, clock_.wall());
        verdict = room_.enter(browser.id, browser.group, seats + away, browser.arrived);
    }
    if (verdict != Verdict::waits) {
        ++refused_;
        hooks_.note_placement(false);
        refuse(browser, verdict == Verdict::full ? no_server : group_full);
        return false;
    }
    browser.is_in_line = true;
    kept_ += browser.request.size();
    browser.rank = room_.rank(browser.id);
    browser.told = TimePoint::min();
    auto const ahead = room_.ahead_of(browser.id);
    tell_place(browser, ahead, estimate_.expect(ahead, now), now);
    if (somebody_waits_)
        somebody_waits_->notify();
    return true;
}

/// The place that a ticket of the browser's keeps, if it is a good one.
void ClientRelay::claim_ticket(Browser& browser)
{
    auto const text = std::exchange(browser.options.waiting_ticket, {});
    if (!hooks_.waiting_mac || text.empty())
        return;
    auto const wall = clock_.wall();
    auto ticket = core::read_waiting_ticket(hooks_.waiting_mac, text, wall, room_.params().max_penalty);
    if (!ticket || !tickets_.is_usable(ticket->id, wall))
        return;
    // The connection that has the place may not know yet that it is lost.
    if (auto const holder = tickets_.enter(ticket->id, ticket->group, browser.id)) {
        auto& old = *browsers_.at(*holder);
        (void)leave_line(old);
        old.channel.close(core::taken_over_code, "another page waits in this place");
    }
    browser.came_back = true;
    browser.group = ticket->group;
    browser.rank = ticket->rank;
    browser.ticket = std::move(*ticket);
}

/// Tickets are made anew from time to time, since each is good for a while only.
void ClientRelay::give_ticket(Browser& browser, TimePoint now)
{
    if (!hooks_.waiting_mac || now < browser.next_ticket)
        return;
    browser.next_ticket = now + core::waiting_ticket_interval;
    if (!browser.ticket) {
        browser.ticket.emplace();
        browser.ticket->id = hooks_.random_bytes(core::waiting_id_size);
        browser.ticket->group = browser.group;
        (void)tickets_.enter(browser.ticket->id, browser.group, browser.id);
    }
    browser.ticket->rank = *browser.rank;
    browser.ticket->issued = clock_.wall();
    (void)browser.channel.send(
        core::waiting_ticket_message(core::make_waiting_ticket(hooks_.waiting_mac, *browser.ticket)));
}

/// Finds a machine, where the browser goes next.
/// Errors: `unavailable`; `refused`: there is no machine that could ever run this.
result<> ClientRelay::try_to_place(Browser& browser, TimePoint now)
{
    auto const placement = find_machine(browser, now);
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
        hooks_.take_seat(browser.options.student, browser.seat, ride.entry, browser.host);
    return {};
}

result<Placement> ClientRelay::find_machine(Browser const& browser, TimePoint now)
{
    auto const message = core::parse_client_message(browser.request);
    auto const& asked = std::get<core::SimulationRequest>(message);
    PlacementRequest request;
    request.world = core::world_of(asked);
    if (auto const* start = std::get_if<core::StartMessage>(&asked))
        request.mode = start->mode;
    request.labels = browser.needs;
    request.held = browser.seat == core::SeatRequest::held;
    request.only_free = params_.waiting_places > 0;
    request.excluded = faults_.silent(now);
    for (auto const* machines : {&browser.tried, &browser.full})
        request.excluded.insert(request.excluded.end(), machines->begin(), machines->end());
    auto const for_last = faults_.unwilling();
    if (for_last.empty())
        return scheduler_.place(request, now);
    auto first = request;
    first.excluded.insert(first.excluded.end(), for_last.begin(), for_last.end());
    if (auto placement = scheduler_.place(first, now))
        return placement;
    return scheduler_.place(request, now);
}

void ClientRelay::start_carrying(Browser& browser)
{
    ++relayed_;
    if (!browser.group.empty())
        ++held_[browser.group];
    if (browser.ride->is_placed)
        hooks_.note_placement(true);
    if (browser.ticket)
        tickets_.serve(std::exchange(browser.ticket, std::nullopt)->id, browser.id, clock_.wall());
    browser.next_ticket = TimePoint::min();
    browser.was_seated = true;
    browser.ride->task = tasks_->spawn(carry(browser));
}

asio::awaitable<void> ClientRelay::carry(Browser& browser)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    bool const goes_back = co_await carry_to_end(browser);
    auto& ride = *browser.ride;
    ride.machine.reset();
    give_back(ride);
    --relayed_;
    if (auto const held = held_.find(browser.group); held != held_.end() && --held->second == 0)
        held_.erase(held);
    if (auto const machine = machines_.find(ride.entry); machine != machines_.end())
        machine->second.freed = clock_.now();
    if (goes_back && !browser.has_left) {
        browser.ride.reset(); // this task's own; the browser may get another one at once
        if (wait_in_line(browser, clock_.now()))
            give_out_seats(clock_.now());
        co_return;
    }
    ride.task.reset();
    ride.ended.notify();
}

/// Until the simulation has ended, no machine takes it, or the browser has left. True: the browser waits
/// again.
asio::awaitable<bool> ClientRelay::carry_to_end(Browser& browser)
{
    auto& ride = *browser.ride;
    for (;;) {
        auto const refusal = co_await converse(browser);
        ride.is_known = false;
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled || browser.has_left || ride.is_at_fault)
            co_return false;
        if (refusal == MachineRefusal::none)
            co_return false;
        ++attempts_[label_of(refusal)];
        ride.machine.reset();
        note_refusal(browser, refusal);
        auto const next = try_again(browser, refusal);
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
    scheduler_.release(placement, clock_.now());
}

void ClientRelay::note_refusal(Browser& browser, MachineRefusal refusal)
{
    auto& ride = *browser.ride;
    auto const now = clock_.now();
    if (!ride.is_placed) // it is not known whether the machine has any such simulation
        return;
    if (refusal == MachineRefusal::silent) {
        faults_.was_silent(ride.entry, now);
        log_.warning(LogCause("silent machine", ride.entry),
                     concat(ride.entry, " does not answer on /client as it should: ", ride.problem));
    } else if (refusal == MachineRefusal::machine) {
        faults_.has_refused(ride.entry, browser.group);
    }
    give_back(ride);
    (refusal == MachineRefusal::full ? browser.full : browser.tried).push_back(ride.entry);
}

/// After a refusal.
ClientRelay::Next ClientRelay::try_again(Browser& browser, MachineRefusal refusal)
{
    auto& ride = *browser.ride;
    if (!ride.is_placed) { // its simulation is there, or nowhere
        browser.channel.close(service_restart);
        return Next::end;
    }
    bool const is_failure = refusal != MachineRefusal::full;
    browser.failures += is_failure ? 1 : 0;
    bool const may_try = browser.failures < max_failures && browser.full.size() < max_full;
    auto const placed = may_try ? try_to_place(browser, clock_.now()) : result<>(Failure(errc::unavailable));
    if (placed)
        return Next::another_machine;
    if (placed.error() == errc::refused) {
        refuse(browser, placed.error().message());
        return Next::end;
    }
    bool const may_wait = params_.waiting_places > 0 && browser.failures < max_failures;
    if (may_wait) {
        browser.full.clear();
        browser.not_before = clock_.now() + pause_after_full;
        return Next::line;
    }
    (void)browser.channel.send(ride.last_word.empty() ? core::error_message(no_server) : ride.last_word);
    browser.channel.close();
    return Next::end;
}

/// With the machine of the browser's ride, until it ends.
asio::awaitable<MachineRefusal> ClientRelay::converse(Browser& browser)
{
    auto& ride = *browser.ride;
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
    auto const latest = clock_.now() + longest_start;
    for (;;) {
        if (!was_ready && clock_.now() > latest) {
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
            browser.needs = conversation.needs();
            ride.last_word = conversation.last_word();
            break;
        }
        if (conversation.is_ready() && !was_ready)
            note_ready(browser);
        was_ready = conversation.is_ready();
    }
    if (was_ready)
        estimate_.session_ended(clock_.now());
    co_return ended;
}

/// The next message of a machine. Errors: as of Channel::receive; `timed_out`: it says nothing any more.
asio::awaitable<result<std::string>> ClientRelay::hear(Channel& machine, Duration patience)
{
    if (patience == Duration::max())
        return machine.receive();
    return async::with_deadline(clock_, clock_.now() + patience, machine.receive());
}

asio::awaitable<result<std::unique_ptr<Channel>>> ClientRelay::connect(Browser const& browser)
{
    auto const& ride = *browser.ride;
    auto const machine = machines_.find(ride.entry);
    if (machine == machines_.end())
        co_return Failure(errc::unreachable, "it was removed from \"simulationServers\"");
    auto const& internal = machine->second.internal_address;
    std::string path = "/client";
    if (hooks_.make_ticket && ride.is_placed)
        path = concat("/ticket/", hooks_.make_ticket(ride.entry), path);
    WebSocketRequest request(internal.empty() ? concat(params_.tls ? "wss://" : "ws://", ride.entry, path)
                                              : concat("ws", core::internal_url(internal, path).substr(4)));
    // The machine answers with an address that this browser can reach, and counts for this browser.
    if (!internal.empty()) {
        bool const has_name = !ride.entry.starts_with(core::asked_name);
        request.headers.emplace_back("Host", has_name ? std::string(authority_of(ride.entry)) : browser.host);
    }
    if (!browser.client.empty())
        request.headers.emplace_back("X-Forwarded-For", browser.client);
    co_return co_await hooks_.websockets->connect(std::move(request));
}

bool ClientRelay::is_ours(std::string_view entry) const
{
    auto const servers = monitor_.servers();
    auto const found = std::find_if(servers.begin(), servers.end(),
                                    [entry](ServerLoad const& server) { return server.address == entry; });
    return found != servers.end() && found->report.arrivals.has_value();
}

void ClientRelay::note_ready(Browser& browser)
{
    auto& ride = *browser.ride;
    ride.is_ready = true;
    ride.opening = {};
    browser.request = {};
    ++attempts_[label_of(MachineRefusal::none)];
    faults_.has_served(ride.entry);
    estimate_.session_began(clock_.now());
}

/// The machine has ended the conversation.
void ClientRelay::end_browser(Browser& browser, Failure const& why)
{
    if (why != errc::closed)
        return browser.channel.close(service_restart); // who can come back does
    auto const code = browser.ride->machine->farewell();
    browser.channel.close(is_for_browsers(code) ? code : internal_error);
}

/// The browser has left.
asio::awaitable<void> ClientRelay::leave(Browser& browser, Failure const& why)
{
    browser.has_left = true;
    given_up_ += leave_line(browser) ? 1 : 0;
    if (browser.ticket)
        tickets_.leave(browser.ticket->id, browser.id, clock_.wall());
    if (!browser.ride)
        co_return;
    auto& ride = *browser.ride;
    bool const is_lost = why == errc::unreachable || is_stopping_;
    if (!is_lost && ride.machine) // it ends the simulation at once; otherwise after the grace
        ride.machine->close(browser.channel.farewell());
    if (ride.task)
        async::TaskGroup::cancel(*ride.task);
    while (ride.task)
        (void)co_await ride.ended.wait();
}

void ClientRelay::update()
{
    give_out_seats(clock_.now());
}

/// False: it was not there.
bool ClientRelay::leave_line(Browser& browser)
{
    if (!room_.leave(browser.id))
        return false;
    browser.is_in_line = false;
    kept_ -= browser.request.size();
    return true;
}

/// First come, first served, but for those who need what no free machine has.
void ClientRelay::give_out_seats(TimePoint now)
{
    if (room_.size() == 0 || is_stopping_ || now - began_ < all_return || !scheduler_.available(now))
        return;
    std::vector<Browser*> seated;
    std::vector<std::pair<Browser*, Failure>> hopeless;
    std::set<std::vector<std::string>> in_vain; // what others ask for that no free machine has
    room_.visit([&](Id id, std::size_t) {
        auto& browser = *browsers_.at(id);
        if (now < browser.not_before || (is_settling(now) && !browser.came_back))
            return true; // it keeps its place
        auto wishes = browser.needs;
        wishes.insert(wishes.end(), browser.tried.begin(), browser.tried.end());
        if (in_vain.contains(wishes))
            return true;
        auto const placed = try_to_place(browser, now);
        if (placed)
            seated.push_back(&browser);
        else if (placed.error() == errc::refused)
            hopeless.emplace_back(&browser, placed.error());
        else if (wishes.empty())
            return false; // nobody else has more to choose from
        else
            in_vain.insert(std::move(wishes));
        return in_vain.size() < max_wishes;
    });
    for (auto* const browser : seated) {
        (void)leave_line(*browser);
        waits_.add(std::chrono::duration<double>(now - browser->waits_since).count());
        (void)browser->channel.send(core::turn_message());
        start_carrying(*browser);
    }
    for (auto const& [browser, why] : hopeless) {
        (void)leave_line(*browser);
        refuse(*browser, why.message());
    }
}

asio::awaitable<result<>> ClientRelay::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    if (!somebody_waits_)
        somebody_waits_.emplace(co_await asio::this_coro::executor);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return Failure(asio::error::operation_aborted);
        result<> waited;
        if (room_.size() == 0) // nobody is to be looked after
            waited = co_await somebody_waits_->wait();
        else
            waited = co_await clock_.wait_until(clock_.now() + look_at_line);
        if (!waited)
            co_return waited;
        auto const now = clock_.now();
        look_for_freed_seats(now);
        give_out_seats(now);
        co_await tell_places();
    }
}

/// A machine's regular reports tell up to `loadRefresh` later that a place is free. While somebody waits,
/// machines are asked more often: those first where a simulation of ours has just ended, then the others in
/// turn.
void ClientRelay::look_for_freed_seats(TimePoint now)
{
    if (room_.size() == 0)
        return;
    std::size_t polls = 0;
    auto const poll = [&](auto& entry) {
        entry.second.polled = now;
        monitor_.poll_now(entry.first);
        ++polls;
    };
    for (auto& entry : machines_)
        if (polls < polls_at_once && now < entry.second.freed + freed_seat_time &&
            now >= entry.second.polled + freed_seat_poll)
            poll(entry);
    auto next = machines_.upper_bound(last_polled_);
    for (std::size_t left = machines_.size(); left > 0 && polls < polls_at_once; --left) {
        if (next == machines_.end())
            next = machines_.begin();
        last_polled_ = next->first;
        if (now >= next->second.polled + any_seat_poll)
            poll(*next);
        ++next;
    }
}

/// Those whose place has changed, and those who have heard nothing for a while.
asio::awaitable<void> ClientRelay::tell_places()
{
    auto const now = clock_.now();
    if (now - told_ < between_tellings)
        co_return;
    told_ = now;
    std::vector<Id> line;
    line.reserve(room_.size());
    room_.visit([&line](Id id, std::size_t) {
        line.push_back(id);
        return true;
    });
    std::optional<core::WaitRange> range;
    std::size_t next_range = 0;
    for (std::size_t ahead = 0; ahead < line.size(); ++ahead) {
        if (ahead >= next_range) { // a range takes some microseconds: those far behind share theirs
            range = estimate_.expect(ahead, now);
            next_range = ahead + 1 + ahead / 50;
        }
        auto const found = browsers_.find(line[ahead]);
        if (found != browsers_.end() && found->second->is_in_line) // others have had their turn meanwhile
            tell_place(*found->second, ahead, range, now);
        if (ahead % told_at_once == told_at_once - 1)
            (void)co_await clock_.wait_until(clock_.now());
    }
}

/// Unless the browser knows it.
void ClientRelay::tell_place(Browser& browser, std::size_t ahead, std::optional<core::WaitRange> const& range,
                             TimePoint now)
{
    bool const is_news = ahead != browser.told_ahead || browser.told == TimePoint::min();
    if (!is_news && now - browser.told < longest_silence)
        return;
    browser.told = now;
    browser.told_ahead = ahead;
    if (browser.options.shows_waiting) {
        give_ticket(browser, now);
        (void)browser.channel.send(core::waiting_message(ahead, range));
        return;
    }
    (void)browser.channel.send(core::queue_message(ahead));
    (void)browser.channel.send(core::waiting_sentence(ahead, range));
}

void ClientRelay::stop()
{
    is_stopping_ = true;
    for (auto const& [id, browser] : browsers_)
        browser->channel.close(service_restart);
}

ClientRelay::Figures ClientRelay::figures() const
{
    Figures figures;
    figures.waiting = room_.size();
    figures.relayed = relayed_;
    figures.given_up = given_up_;
    figures.refused = refused_;
    figures.attempts = attempts_;
    constexpr std::size_t first = 100; // those behind them have come later, but for some minutes
    auto const now = clock_.now();
    room_.visit([&](Id id, std::size_t ahead) {
        figures.longest_wait = std::max(figures.longest_wait, now - browsers_.at(id)->waits_since);
        return ahead < first;
    });
    return figures;
}

} // namespace webots_cloud
