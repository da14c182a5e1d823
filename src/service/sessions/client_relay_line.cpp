// Those who wait: in which order they get seats, and what they are told.
// Decisions: core/waiting/waiting_room, core/waiting/wait_estimate.
#include "client_relay_browser.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "core/prefetch.hpp"
#include "core/refusals.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <array>
#include <set>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr Duration look_at_line = std::chrono::milliseconds(250);
constexpr Duration between_tellings = std::chrono::seconds(1);
constexpr Duration longest_silence = std::chrono::seconds(10); // towards those who wait
// A machine that has just ended a simulation is asked that often and for so long whether its place is free.
constexpr Duration freed_seat_poll = std::chrono::milliseconds(500);
constexpr Duration freed_seat_time = std::chrono::seconds(6);
constexpr Duration any_seat_poll = std::chrono::seconds(1); // of the others, in turn
constexpr std::size_t polls_at_once = 20;
// After a start nobody has a turn at first, and then only those who waited before: they come back about a
// second after they were lost, in no order.
constexpr Duration all_return = std::chrono::milliseconds(1200);
constexpr Duration return_first = std::chrono::seconds(2);

constexpr std::size_t told_at_once = 500;      // browsers, before others have their turn
constexpr std::size_t browsers_prefetched = 4; // this many ahead of the one that is told
constexpr std::size_t channels_prefetched = 2; // of browsers that have been prefetched
constexpr std::size_t max_wishes = 32;         // different ones, of those who want certain machines only
// For heavy worlds, which no free machine has room for:
constexpr std::size_t max_tries = 32;    // placements in one turn that fail
constexpr std::size_t max_passed = 1000; // browsers in one turn, whose worlds were tried a moment ago
constexpr Duration between_tries = std::chrono::seconds(1);

/// Whether a machine with this obstacle answers, and takes sessions when it has room.
bool takes_sessions_later(Refusal obstacle) noexcept
{
    switch (obstacle) {
    case Refusal::none:
    case Refusal::full:
    case Refusal::memory:
    case Refusal::load:
    case Refusal::committed:
        return true;
    default:
        return false;
    }
}

} // namespace

/// Browsers that waited before a restart come back within a moment, and others are not served before.
bool ClientRelay::is_settling(TimePoint now) const
{
    return now - began_ < return_first;
}

/// Whose seats count together with this browser's; empty: nobody's, as behind a trusted proxy that names no
/// clients.
std::string ClientRelay::group_of(Browser const& browser, std::string const& quota_key) const
{
    auto key = quota_key;
    if (auto const& student = browser.options.student; !student.empty())
        if (auto const of_class = classes_.class_of(student); !of_class.empty())
            key = concat("class ", of_class);
    auto const& mac = site_.hooks.sign_waiting_ticket;
    return mac ? core::waiting_group(mac, key) : key;
}

/// The browser with that many ahead of it in the line.
ClientRelay::Browser& ClientRelay::browser_at(std::size_t ahead) const
{
    return static_cast<Browser&>(room_.at(ahead));
}

/// False: it may not, and is told so.
bool ClientRelay::wait_in_line(Browser& browser, TimePoint now)
{
    using Verdict = core::WaitingRoom::Verdict;
    auto verdict = Verdict::waits;
    if (browser.was_seated) { // and the machine had no place
        room_.put_back(browser);
    } else if (browser.came_back) {
        verdict = room_.return_to(browser);
    } else {
        // Those of the group who have left and may come back count as well: otherwise leaving would be a way
        // to collect places.
        auto const away = tickets_.away(browser.group, site_.clock.wall());
        verdict = room_.enter(browser, held_.of(browser.group) + away);
    }
    if (verdict != Verdict::waits) {
        ++refused_;
        sessions_.note_placement(false, now);
        refuse(browser,
               verdict == Verdict::full ? core::Refused::no_machine_to_relay : core::Refused::too_many_wait);
        return false;
    }
    kept_ += browser.request.size();
    students_ += browser.options.student.empty() ? 0 : 1;
    browser.told = TimePoint::min();
    note_supply();
    tell_place(browser, room_.ahead_of(browser), now);
    note_change();
    availability_.note_line(room_.size());
    return true;
}

/// False: it was not there.
bool ClientRelay::leave_line(Browser& browser)
{
    if (!room_.leave(browser))
        return false;
    set_wants_room(browser, false);
    kept_ -= browser.request.size();
    students_ -= browser.options.student.empty() ? 0 : 1;
    note_change();
    availability_.note_line(room_.size());
    return true;
}

/// What it needs that others may not: labels, and other machines than those that have refused it.
std::vector<std::string> ClientRelay::wishes_of(Browser const& browser, TimePoint now)
{
    std::vector<std::string> wishes;
    if (auto const* refusals = browser.refusals.get()) {
        wishes = refusals->needs;
        for (auto const& refuser : refusals->refusers)
            if (now < refuser.until)
                wishes.push_back(refuser.entry);
    }
    return wishes;
}

/// Whether a machine that answers may still take it: one that has not refused it, however busy it is.
/// Machines that are away may never come back.
bool ClientRelay::may_be_taken(Browser const& browser, TimePoint now) const
{
    auto const* const refusals = browser.refusals.get();
    return !refusals || std::any_of(machines_.begin(), machines_.end(), [&](auto const& machine) {
        auto const& entry = machine.first;
        return takes_sessions_later(site_.scheduler.refusal_of(entry, now, refusals->needs)) &&
               !refusals->is_by(entry);
    });
}

/// Why no machine takes it.
void ClientRelay::tell_refusal(Browser& browser)
{
    auto const* const refusals = browser.refusals.get();
    if (!refusals || refusals->last_word.empty())
        return refuse(browser, core::Refused::no_machine_to_relay);
    if (browser.options.wants_reasons && !refusals->last_reason.empty())
        (void)browser.channel.send(refusals->last_reason);
    (void)browser.channel.send(core::error_message(refusals->last_word));
    browser.channel.close();
}

/// Whether only a machine with room for its world comes into question. Not for those who come back: they have
/// waited.
bool ClientRelay::must_fit(Browser const& browser, TimePoint now) const noexcept
{
    return room_.params().places > 0 && !browser.came_back &&
           now < browser.waits_since + relay::longest_wait_for_room;
}

/// Somebody who wants the same has just waited in vain, and comes first if there is room now.
bool ClientRelay::is_known_to_be_too_large(Browser const& browser, TimePoint now) const
{
    return !too_large_.empty() && must_fit(browser, now) &&
           too_large_.contains({browser.world, wishes_of(browser, now)});
}

void ClientRelay::set_wants_room(Browser& browser, bool wants)
{
    if (browser.wants_room == wants)
        return;
    browser.wants_room = wants;
    if (wants)
        ++want_room_;
    else
        --want_room_;
    browser.told = TimePoint::min(); // its wait is another one now
    note_change();
}

/// A browser that wants room waits for a limited time; how long machines stay away or busy, nobody knows.
std::optional<core::WaitRange> ClientRelay::expected_wait(Browser const& browser, core::WaitReason why,
                                                          std::size_t ahead, TimePoint now) const
{
    if (core::ends_with_a_session(why))
        return estimate_.expect(ahead, now);
    if (why != core::WaitReason::room)
        return std::nullopt;
    core::WaitRange range;
    range.most = std::max(browser.waits_since + relay::longest_wait_for_room - now, between_tries);
    return range;
}

/// The place that a ticket of the browser's keeps, if it is a good one.
void ClientRelay::claim_ticket(Browser& browser)
{
    auto const text = std::exchange(browser.options.waiting_ticket, {});
    if (!site_.hooks.sign_waiting_ticket || text.empty())
        return;
    auto const wall = site_.clock.wall();
    auto const ticket =
        core::read_waiting_ticket(site_.hooks.sign_waiting_ticket, text, wall, room_.params().max_penalty);
    if (!ticket || !tickets_.is_usable(ticket->id, wall))
        return;
    // The connection that has the place may not know yet that it is lost.
    if (auto const holder = tickets_.enter(ticket->id, ticket->group, browser.id)) {
        auto& old = browsers_.at(*holder);
        (void)leave_line(old);
        old.channel.close(core::taken_over_code, "another page waits in this place");
    }
    browser.came_back = true;
    browser.group = ticket->group;
    browser.rank = ticket->rank;
    browser.ticket = ticket->id;
}

/// Tickets are made anew from time to time, since each is good for a while only.
void ClientRelay::give_ticket(Browser& browser, TimePoint now)
{
    if (!site_.hooks.sign_waiting_ticket || now < browser.next_ticket)
        return;
    browser.next_ticket = now + core::waiting_ticket_interval;
    if (!browser.ticket) {
        auto& id = browser.ticket.emplace();
        site_.hooks.random_bytes(id.size()).copy(id.data(), id.size());
        (void)tickets_.enter(id, browser.group, browser.id);
    }
    core::WaitingTicket const ticket{*browser.ticket, browser.group, browser.rank, site_.clock.wall()};
    (void)browser.channel.send(
        core::waiting_ticket_message(core::make_waiting_ticket(site_.hooks.sign_waiting_ticket, ticket)));
}

/// First come, first served, but for those who need what no free machine has, or more room than it has left:
/// others pass them, but nobody who wants the same.
void ClientRelay::give_out_seats(TimePoint now)
{
    bool is_for_all = site_.scheduler.available(now); // else what is free is held for students
    if (room_.size() == 0 || is_stopping_ || now - began_ < all_return || !(is_for_all || students_ > 0))
        return;
    std::erase_if(too_large_, [now](auto const& tried) { return now >= tried.second; });
    // Collected first: whoever leaves the line moves the others in it.
    std::vector<Browser*> seated;
    std::vector<std::pair<Browser*, Failure>> hopeless;
    std::vector<Browser*> refused; // by all machines that answer
    // What others ask for that no free machine has; students have more to choose from.
    std::set<std::pair<bool, std::vector<std::string>>> in_vain;
    std::size_t doubts = 0;
    // Only for a few of those who were refused in each turn: all machines are looked at for each of them.
    auto const is_refused_everywhere = [&](Browser const& browser) {
        return browser.refusals && ++doubts <= max_tries && !may_be_taken(browser, now);
    };
    std::size_t tries = 0;
    std::size_t passed = 0;
    auto const may_go_on = [&] {
        return tries < max_tries && passed < max_passed && in_vain.size() < max_wishes;
    };
    for (std::size_t ahead = 0; ahead < room_.size() && may_go_on(); ++ahead) {
        auto& browser = browser_at(ahead);
        if (is_settling(now) && !browser.came_back)
            continue; // it keeps its place
        if (now < browser.not_before) {
            ++passed;
            continue;
        }
        // Others of its class have come or gone since it was asked last.
        ask_for_seat(browser);
        bool const is_held = browser.seat == core::SeatRequest::held;
        if (!is_for_all && !is_held)
            continue;
        if (is_known_to_be_too_large(browser, now)) {
            set_wants_room(browser, true);
            ++passed;
            continue;
        }
        auto wishes = wishes_of(browser, now);
        // Somebody ahead of it wants the same, and has got nothing.
        if (in_vain.contains({is_held, wishes})) {
            if (is_refused_everywhere(browser))
                refused.push_back(&browser);
            continue;
        }
        auto const placed = try_to_place(browser, request_of(browser, now), now);
        set_wants_room(browser, !placed && placed.error() == errc::too_large);
        if (browser.wants_room) {
            too_large_.emplace(std::pair(browser.world, std::move(wishes)), now + between_tries);
            ++tries;
        } else if (placed) {
            seated.push_back(&browser);
        } else if (placed.error() == errc::refused) {
            hopeless.emplace_back(&browser, placed.error());
        } else if (wishes.empty() && (is_held || students_ == 0)) {
            break; // nobody else has more to choose from
        } else if (wishes.empty()) {
            is_for_all = false;
        } else {
            if (is_refused_everywhere(browser))
                refused.push_back(&browser);
            in_vain.emplace(is_held, std::move(wishes));
        }
    }
    for (auto* const browser : seated) {
        (void)leave_line(*browser);
        waits_.add(std::chrono::duration<double>(now - browser->waits_since).count());
        (void)browser->channel.send(core::turn_message());
        start_carrying(*browser);
    }
    for (auto const& [browser, why] : hopeless) {
        (void)leave_line(*browser);
        refuse(*browser, why);
    }
    for (auto* const browser : refused) {
        (void)leave_line(*browser);
        tell_refusal(*browser);
    }
}

asio::awaitable<result<>> ClientRelay::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    if (!line_changed_)
        line_changed_.emplace(co_await asio::this_coro::executor);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return Failure(asio::error::operation_aborted);
        auto const waited = co_await wait_for_work();
        if (!waited)
            co_return waited;
        auto const now = site_.clock.now();
        drop_silent(now);
        look_for_freed_seats(now);
        give_out_seats(now);
        co_await tell_places();
    }
}

/// What keeps everybody waiting may be something else now.
void ClientRelay::note_supply()
{
    auto const supply = availability_.supply(site_.clock.now());
    has_changed_ = has_changed_ || supply != supply_;
    supply_ = supply;
}

void ClientRelay::note_change()
{
    has_changed_ = true;
    if (line_changed_)
        line_changed_->notify();
}

/// Until the line has changed, and those in it may be told, or it is time to look after them, or after those
/// who have said nothing yet.
asio::awaitable<result<>> ClientRelay::wait_for_work()
{
    auto const now = site_.clock.now();
    bool const is_line = room_.size() > 0;
    auto const silent = silent_.first();
    if (!is_line && !silent) // nobody is to be looked after
        co_return co_await line_changed_->wait();
    if (is_line && has_changed_ && now - told_ < between_tellings)
        co_return co_await site_.clock.wait_until(now + look_at_line);
    auto const until = is_line ? now + look_at_line : end_of_silence(*silent);
    auto changed = co_await async::with_deadline(site_.clock, until, line_changed_->wait());
    if (!changed && changed.error() == errc::timed_out)
        co_return result<>();
    co_return changed;
}

/// A machine's regular reports tell up to `loadRefresh` later that a place is free. While somebody waits,
/// machines are asked more often: those first where one of our simulations has just ended, then the others in
/// turn.
void ClientRelay::look_for_freed_seats(TimePoint now)
{
    if (room_.size() == 0)
        return;
    std::size_t polls = 0;
    auto const poll = [&](auto& entry) {
        entry.second.polled = now;
        site_.monitor.poll_now(entry.first);
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
    auto const now = site_.clock.now();
    note_supply();
    if (now - (has_changed_ ? told_ : looked_) < between_tellings)
        co_return;
    looked_ = now;
    if (std::exchange(has_changed_, false))
        told_ = now;
    for (std::size_t first = 0; first < room_.size(); first += told_at_once) {
        tell_part(first, std::min(first + told_at_once, room_.size()), now);
        // The event loop has its turn between two parts.
        (void)co_await site_.clock.wait_until(site_.clock.now());
    }
}

/// Tells those who have `first` to `end - 1` others ahead.
///
/// With 10,000 browsers hardly any of them is in the processor's caches. If each were loaded just when it is
/// told, most of our own time would go by waiting for memory.
void ClientRelay::tell_part(std::size_t first, std::size_t end, TimePoint now)
{
    for (std::size_t ahead = first; ahead < end; ++ahead) {
        if (ahead + browsers_prefetched < end)
            core::prefetch(&browser_at(ahead + browsers_prefetched));
        if (ahead + channels_prefetched < end)
            core::prefetch(&browser_at(ahead + channels_prefetched).channel);
        tell_place(browser_at(ahead), ahead, now);
    }
}

/// Unless the browser knows it.
void ClientRelay::tell_place(Browser& browser, std::size_t ahead, TimePoint now)
{
    auto const why = core::wait_reason(supply_, browser.wants_room, browser.refusals != nullptr);
    bool const is_news =
        ahead != browser.told_wait.ahead() || why != browser.told_why || browser.told == TimePoint::min();
    if (!is_news && now - browser.told < longest_silence)
        return;
    browser.told = now;
    if (std::exchange(browser.told_why, why) != why)
        browser.told_wait.forget();
    auto const wait = browser.told_wait.tell(ahead, expected_wait(browser, why, ahead, now), now);
    core::PlaceInLine const place{ahead, wait, why};
    if (browser.options.shows_waiting) {
        give_ticket(browser, now);
        (void)browser.channel.send(core::waiting_message(place));
        return;
    }
    std::array const messages{core::queue_message(ahead), core::waiting_sentence(place)};
    (void)browser.channel.send_all(messages);
}

} // namespace webots_cloud
