// Decisions: core/classes/class_staging.
#include "class_stager.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "core/access/asked_name.hpp"
#include "core/text.hpp"
#include "machine_request.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// A machine forgets a session server that is silent for 30 s.
constexpr Duration say_again = std::chrono::seconds(10);
constexpr Duration longest_answer = std::chrono::seconds(30);
// Between two connections to a machine.
constexpr Duration next_staging_try = std::chrono::seconds(10);

} // namespace

asio::awaitable<result<>> ClassStager::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    tasks_.emplace(executor);
    auto const ended = co_await async::until_cancelled();
    co_await tasks_->end();
    tasks_.reset();
    co_return ended;
}

/// Those that say that they would, and have free seats.
std::vector<core::StagingMachine> ClassStager::machines() const
{
    std::vector<core::StagingMachine> machines;
    for (auto const& machine : site_.fleet.machines()) {
        auto const* const server = site_.monitor.find(machine.spec.address);
        if (!server || server->state != ServerState::up || machine.is_draining())
            continue;
        auto const& report = server->report;
        int const most = report.staging.value_or(0);
        int const free = report.capacity.value_or(most) - report.sessions.value_or(0);
        if (most > 0 && free > 0)
            machines.emplace_back(machine.spec.address, std::min(most, free));
    }
    return machines;
}

std::vector<int> ClassStager::update(std::vector<core::StagingWish> classes)
{
    if (!tasks_ || !site_.hooks.websockets || (classes.empty() && links_.empty()))
        return {};
    staging_.update(classes, machines(), site_.clock.now());
    for (auto const& machine : site_.fleet.machines())
        if (!staging_.wishes_for(machine.spec.address).empty())
            links_.try_emplace(machine.spec.address);
    for (auto& [machine, link] : links_)
        speak(machine, link);
    std::erase_if(links_, [this](auto const& entry) {
        return !entry.second.is_open && staging_.wishes_for(entry.first).empty();
    });
    return staging_.ready();
}

void ClassStager::speak(std::string const& machine, Link& link)
{
    auto wishes = staging_.wishes_for(machine);
    auto const now = site_.clock.now();
    if (wishes.empty() && link.channel)
        return link.channel->close(); // what is ready there is given back
    // Also when nothing has changed, from time to time: the machine forgets those who say nothing.
    if (link.channel && (wishes != link.said || now - link.said_at >= say_again))
        return say(link, std::move(wishes));
    auto const* const server = site_.fleet.find(machine);
    if (wishes.empty() || link.is_open || !server || now < link.next_try)
        return;
    // `update` may come again before the task begins, and must not connect twice or forget the link.
    link.is_open = true;
    auto request = machine_websocket(server->spec, site_.config.address.ssl,
                                     concat(site_.ticket_path(machine), "/client"));
    bool const has_name = !machine.starts_with(core::asked_name) && !server->spec.has_own_path;
    if (!request.address.empty() && has_name)
        request.headers.emplace_back("Host", authority_of_entry(machine));
    tasks_->spawn(keep(machine, std::move(request)));
}

void ClassStager::say(Link& link, std::vector<core::StagingWish> wishes)
{
    (void)link.channel->send(core::stage_message(wishes));
    link.said = std::move(wishes);
    link.said_at = site_.clock.now();
}

/// A connection, until it ends.
asio::awaitable<void> ClassStager::keep(std::string machine, WebSocketRequest request)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const problem = co_await converse(machine, std::move(request));
    auto& link = links_.at(machine);
    bool const cancelled = co_await async::is_cancelled();
    if (!cancelled && !staging_.wishes_for(machine).empty())
        site_.log.warning(LogCause("class staging", machine),
                          concat(machine, " has nothing ready for classes at the moment: ", problem));
    link.channel.reset();
    link.is_open = false;
    link.said.clear();
    link.next_try = site_.clock.now() + next_staging_try;
    staging_.lost(machine);
}

/// Returns what has ended it.
asio::awaitable<std::string> ClassStager::converse(std::string machine, WebSocketRequest request)
{
    auto& link = links_.at(machine);
    auto opened = co_await site_.hooks.websockets->connect(std::move(request));
    if (!opened)
        co_return opened.error().message();
    link.channel = std::move(*opened);
    if (auto wishes = staging_.wishes_for(machine); !wishes.empty())
        say(link, std::move(wishes));
    else
        link.channel->close();
    for (;;) {
        auto const deadline = site_.clock.now() + longest_answer;
        auto const text = co_await async::with_deadline(site_.clock, deadline, link.channel->receive());
        if (!text)
            co_return text.error().message();
        auto const figures = core::parse_staged_message(*text);
        if (!figures)
            co_return core::printable(*text, 200);
        staging_.heard(machine, *figures);
    }
}

} // namespace webots_cloud
