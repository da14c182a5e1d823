// GET /session is the busiest request of a site. It is answered from memory, and looks only at what the
// answer depends on; instruction_counts.py guards that.
// Decisions: core/placement/scheduler, core/access/token_buckets, core/access/site_addresses.
#include "session_endpoint.hpp"

#include "core/classes/class_paths.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"

#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

/// What `/session` answers instead of an address.
std::string session_error(core::Refused why)
{
    return concat("Error: ", core::row_of(why).sentence);
}

/// `text`: an address, or why there is none, which pages know by its code. `html_for_any_origin` includes the
/// content type: one of its own would cost an allocation.
Answer session_answer(std::string text, core::Refused why = core::Refused::no_machine)
{
    Answer answer(std::in_place_type<HttpResponse>, 200, std::string(), std::move(text));
    auto& response = std::get<HttpResponse>(answer);
    response.fixed_headers = html_for_any_origin;
    if (response.body.starts_with("Error:")) {
        response.headers.emplace_back("Webots-Reason", core::row_of(why).code);
        response.headers.emplace_back("Access-Control-Expose-Headers", "Webots-Reason");
    }
    return answer;
}

/// With status 200, as every answer of /session: pages of before 2021 show nothing for any other status, and
/// later ones only look at the text.
Answer too_many_asked(Duration wait)
{
    auto answer =
        session_answer(session_error(core::Refused::too_many_starts), core::Refused::too_many_starts);
    std::get<HttpResponse>(answer).headers.emplace_back("Retry-After", core::seconds_rounded_up(wait));
    return answer;
}

asio::awaitable<void> say(std::string text, Channel& channel)
{
    (void)channel.send(std::move(text));
    channel.close(1000);
    co_return;
}

} // namespace

SessionEndpoint::SessionEndpoint(SiteContext const& site, ClassEndpoint& classes,
                                 SiteAvailability& availability)
    : site_(site), classes_(classes), availability_(availability)
{
    set_budget();
}

void SessionEndpoint::apply(SessionServiceConfig const& before)
{
    auto const& config = site_.config.service;
    if (config.session_burst != before.session_burst || config.session_rate != before.session_rate)
        set_budget();
}

void SessionEndpoint::set_budget()
{
    auto const& config = site_.config.service;
    asked_ = core::TokenBuckets(static_cast<std::size_t>(config.session_burst), config.session_rate);
}

bool SessionEndpoint::may_ask(std::string_view quota_key, TimePoint now)
{
    auto const verdict = asked_.take(quota_key, now);
    if (verdict == core::TokenBuckets::Verdict::taken)
        return true;
    ++limited_;
    if (verdict == core::TokenBuckets::Verdict::refused_first)
        site_.log.warning(
            LogCause("session limit"),
            concat("More requests for /session than one address may send come from ", asked_.refused_by(),
                   ": see \"sessionBurst\" and \"sessionRate\", and \"trustedProxies\" if that is a proxy"));
    return false;
}

void SessionEndpoint::note_placement(bool is_placed, TimePoint now)
{
    ++(is_placed ? placed_ : refused_);
    availability_.update(now);
}

/// `token` and `seat` are of a student; others have `unknown`. `get_asked` returns where the request has
/// asked us, which is looked for only where the address depends on that.
template<class GetAsked>
std::string SessionEndpoint::place(TimePoint now, std::string_view token, core::SeatRequest seat,
                                   GetAsked const& get_asked)
{
    bool const is_held = seat == core::SeatRequest::held;
    auto const placement = is_held ? site_.scheduler.place_held(now) : site_.scheduler.place(now);
    if (!placement) {
        note_placement(false, now);
        return session_error(core::Refused::no_machine);
    }
    auto const& entry = placement->address;
    auto const by = site_.addresses.depends_on_asked(entry) ? get_asked() : AskedAddress();
    if (seat != core::SeatRequest::unknown)
        classes_.take_seat(token, seat, entry, by, now);
    note_placement(true, now);
    return site_.machine_address(entry, by);
}

/// What `/session` answers where this server relays. No place is taken before a browser asks for a
/// simulation.
std::string SessionEndpoint::own_address(AskedAddress const& by) const
{
    if (!availability_.takes_more(site_.clock.now()))
        return session_error(core::Refused::no_machine);
    return site_.addresses.own_base(by);
}

Answer SessionEndpoint::answer(IncomingRequest const& request)
{
    if (request.method == "GET") {
        if (relays())
            return session_answer(own_address(asked_by(request)));
        auto const now = site_.clock.now();
        auto const token = core::class_token(request.query);
        // Before the class is asked: wrong tokens can be tried no more often than that, either.
        if (!may_ask(request.quota_key, now))
            return too_many_asked(asked_.interval());
        auto const seat = classes_.ask_for_seat(token, now);
        if (seat == core::SeatRequest::too_often)
            return too_many_asked(core::class_limits::seat_interval);
        auto const get_asked = [&request] { return asked_by(request); };
        return session_answer(place(now, token, seat, get_asked));
    }
    bool const is_head = request.method == "HEAD"; // only asks whether the server is there: takes no place
    HttpResponse response(is_head ? 200 : 204, {}, {});
    response.fixed_headers = is_head ? html_for_any_origin : any_origin;
    return response;
}

asio::awaitable<void> SessionEndpoint::serve(ChannelInfo const& info, Channel& channel)
{
    if (relays())
        return say(own_address(info.asked), channel);
    auto const now = site_.clock.now();
    auto const token = core::class_token(info.query);
    auto const seat =
        may_ask(info.quota_key, now) ? classes_.ask_for_seat(token, now) : core::SeatRequest::too_often;
    if (seat == core::SeatRequest::too_often)
        return say(session_error(core::Refused::too_many_starts), channel);
    auto const get_asked = [&info]() -> AskedAddress const& { return info.asked; };
    return say(place(now, token, seat, get_asked), channel);
}

void SessionEndpoint::write_metrics(core::MetricsText& text) const
{
    text.family(core::metric("placements_total"))
        .add(static_cast<double>(placed_), {{"result", "placed"}})
        .add(static_cast<double>(refused_), {{"result", "refused"}})
        .add(static_cast<double>(limited_), {{"result", "limited"}});
}

} // namespace webots_cloud
