#include "waiting_messages.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view no_estimate = "there is no estimate of the wait yet";

/// 4 or 1.5 `minutes`; of rounded times, halves are all there is.
std::string number(Duration time, Duration unit)
{
    auto const halves = time / (unit / 2);
    return concat(std::to_string(halves / 2), halves % 2 == 1 ? ".5" : "");
}

bool in_seconds(Duration time)
{
    return time < 1min;
}

std::string time_text(Duration time)
{
    if (in_seconds(time))
        return concat(number(time, 1s), " seconds");
    return concat(number(time, 1min), time == 1min ? " minute" : " minutes");
}

std::string wait_text(WaitRange const& wait)
{
    auto const [least, most] = rounded(wait);
    if (least >= 1h)
        return "the wait is more than an hour";
    if (most > 1h)
        return least == 0s
                   ? "the wait may be more than an hour"
                   : concat("the wait is at least ", time_text(least), ", and may be more than an hour");
    auto const last = most == 1h ? std::string("an hour") : time_text(most);
    if (least == 0s)
        return concat("the wait is less than ", last);
    if (least == most)
        return concat("the wait is about ", last);
    bool const same_unit = in_seconds(least) == in_seconds(most) && most < 1h;
    return concat("the wait is about ",
                  same_unit ? number(least, in_seconds(least) ? 1s : 1min) : time_text(least), " to ", last);
}

struct ReasonText
{
    std::string_view word;   // behind a space
    std::string_view clause; // of the sentence
};

ReasonText text_of(WaitReason why) noexcept
{
    switch (why) {
    case WaitReason::seat:
        break;
    case WaitReason::room:
        return {" room", ", and no free machine has enough power left for this world"};
    case WaitReason::busy:
        return {" busy", ", and the machines are too busy for another simulation"};
    case WaitReason::suitable:
        return {" suitable", ", and no machine that can run this world is free"};
    case WaitReason::draining:
        return {" draining", ", but no machine takes new simulations at the moment"};
    case WaitReason::down:
        return {" down", ", but no machine is running"};
    }
    return {};
}

} // namespace

std::string_view word_of(WaitReason why) noexcept
{
    return why == WaitReason::seat ? std::string_view("seat") : text_of(why).word.substr(1);
}

WaitReason wait_reason(SiteState supply, bool wants_room, bool is_choosy) noexcept
{
    if (wants_room)
        return WaitReason::room;
    switch (supply) {
    case SiteState::free:
        return is_choosy ? WaitReason::suitable : WaitReason::seat;
    case SiteState::busy:
        return WaitReason::busy;
    case SiteState::draining:
        return WaitReason::draining;
    case SiteState::down:
        return WaitReason::down;
    case SiteState::full:
    case SiteState::unknown:
        break;
    }
    return WaitReason::seat;
}

std::string queue_message(std::size_t ahead)
{
    return concat("queue:", std::to_string(ahead));
}

std::string waiting_sentence(PlaceInLine const& place)
{
    auto const number = place.ahead == 0 ? std::string() : std::to_string(place.ahead);
    std::string_view const ahead = place.ahead == 0   ? "You are next"
                                   : place.ahead == 1 ? " is ahead of you"
                                                      : " are ahead of you";
    auto const estimate = place.wait ? wait_text(*place.wait) : std::string();
    auto const wait = place.wait ? std::string_view(estimate) : no_estimate;
    return concat("loading: ", number, ahead, text_of(place.why).clause, "; ", wait, ".");
}

std::string waiting_message(PlaceInLine const& place)
{
    auto const seconds = [](Duration time) {
        return std::to_string(std::chrono::duration_cast<std::chrono::seconds>(time).count());
    };
    auto const why = text_of(place.why).word;
    if (!place.wait)
        return concat("waiting: ", std::to_string(place.ahead), " - -", why);
    auto const [least, most] = rounded(*place.wait);
    return concat("waiting: ", std::to_string(place.ahead), " ", seconds(least), " ", seconds(most), why);
}

std::string waiting_ticket_message(std::string_view ticket)
{
    return concat("waitingTicket: ", ticket);
}

std::string turn_message()
{
    return "loading: A machine is free.";
}

} // namespace webots_cloud::core
