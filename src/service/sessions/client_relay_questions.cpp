// Where other session servers place here too: the best machines are asked whom they have got, before one is
// chosen.
// Decisions: core/relay/machine_questions.
#include "client_relay_browser.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

/// Asks those that are worth it, with all others who ask at this moment. Returns for whose answers the
/// browser is to wait.
std::vector<std::string> ClientRelay::ask_machines(Browser const& browser, PlacementRequest const& request,
                                                   TimePoint now)
{
    using Verdict = core::MachineQuestions::Verdict;
    std::vector<std::string> asked;
    for (auto const entry : site_.scheduler.worth_asking(request, now)) {
        auto const verdict = questions_.ask(entry, browser.id, now);
        if (verdict == Verdict::pass)
            continue;
        asked.emplace_back(entry);
        if (verdict == Verdict::wait)
            continue;
        ++questions_asked_;
        site_.monitor.poll_now(entry);
    }
    return asked;
}

void ClientRelay::heard_from(std::string_view entry)
{
    for (auto const id : questions_.answered(entry))
        if (auto const found = browsers_.find(id); found != browsers_.end() && found->second.ride)
            found->second.ride->changed.notify();
}

/// After the answers another machine may be the best, so those that are best then are asked, too: in the
/// simulation of docs/scheduling.md a third time brings nothing.
asio::awaitable<void> ClientRelay::serve_when_answered(Browser& browser, std::vector<std::string> asked,
                                                       TimePoint since)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const latest = site_.clock.now() + core::MachineQuestions::patience;
    bool const have_answered = co_await hear_answers(browser, asked, latest);
    if (have_answered) {
        auto request = request_of(browser, site_.clock.now());
        request.current_since = since;
        asked = ask_machines(browser, request, site_.clock.now());
        (void)co_await hear_answers(browser, asked, latest);
    }
    bool const cancelled = co_await async::is_cancelled();
    // `leave` waits for this.
    if (cancelled || browser.has_left) {
        browser.ride->task.reset();
        browser.ride->changed.notify();
        co_return;
    }
    browser.ride.reset(); // this task's own
    auto const now = site_.clock.now();
    auto request = request_of(browser, now);
    request.current_since = since;
    serve_now(browser, request, now);
}

/// False: not all in time, or the browser has left.
asio::awaitable<bool> ClientRelay::hear_answers(Browser& browser, std::vector<std::string> const& asked,
                                                TimePoint latest)
{
    auto const is_open = [this](std::string const& entry) { return questions_.is_open(entry); };
    while (std::any_of(asked.begin(), asked.end(), is_open)) {
        auto const heard = co_await async::with_deadline(site_.clock, latest, browser.ride->changed.wait());
        if (heard)
            continue;
        if (heard.error() == errc::timed_out)
            for (auto const& entry : asked)
                questions_.give_up(entry, site_.clock.now());
        co_return false;
    }
    co_return true;
}

} // namespace webots_cloud
