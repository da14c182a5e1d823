// Looks once a second, and whenever something has changed, what core::Staging wants: begins one staged
// simulation, gives others back. The simulations are SimulationSessions, which clean up after themselves.
// Decisions: core/simulation/staging.
#include "stager.hpp"

#include "async/cancellation.hpp"
#include "async/first_of.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr auto look_interval = std::chrono::seconds(1);
// A simulator that is ended is killed after SimulationLauncherParams::grace, which is shorter.
constexpr auto longest_end = std::chrono::seconds(10);

core::SimulationRequest request_for(core::StagedWorld const& world)
{
    core::StartMessage start;
    start.url = world.url;
    start.mode = world.mode;
    start.relayed = true;    // what only some browsers may start here is not staged
    start.has_editor = true; // the one that comes may have one
    return start;
}

} // namespace

Stager::Stager(SessionContext& context, SimulationSessions& sessions, std::function<std::uint64_t()> new_id)
    : context_(context), sessions_(sessions), new_id_(std::move(new_id))
{
    apply();
}

void Stager::apply()
{
    std::vector<core::StagedWorld> worlds;
    for (auto const& configured : context_.params.config.staged) {
        auto const parsed = context_.fetcher.parse(configured.url);
        if (!parsed)
            continue; // a program's own configuration; those of files have been checked
        core::StagedWorld world;
        world.url = configured.url;
        world.address = parsed->address();
        world.mode = configured.mode;
        world.count = configured.count;
        worlds.push_back(std::move(world));
    }
    staging_.apply(std::move(worlds), context_.params.config.staged_max_age);
    on_change();
}

void Stager::on_change()
{
    if (changed_ && !staging_.is_idle())
        changed_->notify();
}

core::StagingRoom Stager::room() const
{
    core::StagingRoom room;
    room.seats = context_.admission.max_simulations();
    room.taken = context_.admission.simulations();
    room.load = context_.load;
    room.memory = context_.memory;
    room.browser_starts = std::any_of(sessions_.begin(), sessions_.end(), [](auto const& entry) {
        return entry.second->is_starting() && !entry.second->is_staged();
    });
    room.is_open = !context_.state.is_draining() && !context_.state.is_stopping();
    return room;
}

void Stager::act()
{
    auto const plan = staging_.plan(context_.clock.now(), room());
    for (auto const id : plan.give_back) {
        staging_.given_back(id);
        if (auto const found = sessions_.find(id); found != sessions_.end())
            found->second->give_back();
    }
    if (!plan.next)
        return;
    auto const id = new_id_();
    staging_.begun(id, *plan.next, context_.clock.now());
    tasks_->spawn(prepare(id, request_for(staging_.worlds()[*plan.next])));
}

asio::awaitable<result<>> Stager::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    auto& clock = context_.clock;
    tasks_.emplace(executor);
    changed_.emplace(executor);
    for (bool running = true; running;) {
        act();
        auto const next = staging_.is_idle() ? TimePoint::max() : clock.now() + look_interval;
        auto parts = async::first_of(changed_->wait(), clock.wait_until(next));
        auto const waited = co_await std::move(parts);
        bool const cancelled = co_await async::is_cancelled();
        running = waited && !cancelled;
    }
    for (auto const& [id, session] : sessions_)
        session->give_back();
    co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
    co_await tasks_->join();
    co_return Failure(asio::error::operation_aborted);
}

/// Until it has ended, or a browser has it.
asio::awaitable<void> Stager::prepare(std::uint64_t id, core::SimulationRequest request)
{
    auto const executor = co_await asio::this_coro::executor;
    auto const session = std::make_shared<SimulationSession>(
        context_, executor, id, std::string(), std::move(request), SimulationSession::Browser::awaited);
    sessions_.emplace(id, session);
    co_await session->run_staged();
    if (!session->is_over())
        co_return;
    staging_.ended(id, context_.clock.now());
    sessions_.erase(id);
    ++context_.changes;
    for (auto* const wait : seat_waits_)
        wait->notify();
    on_change();
}

asio::awaitable<std::shared_ptr<SimulationSession>> Stager::take(std::string quota_key,
                                                                 core::SimulationRequest request)
{
    auto const* const start = std::get_if<core::StartMessage>(&request);
    if (staging_.is_idle() || !start || start->fetch_only)
        co_return nullptr;
    auto const world = context_.fetcher.parse(start->url);
    auto const id = world ? staging_.find(world->address(), start->mode) : std::nullopt;
    auto const found = id ? sessions_.find(*id) : sessions_.end();
    if (found == sessions_.end())
        co_return nullptr;
    auto session = found->second;
    if (!session->claim(quota_key, request))
        co_return nullptr;
    staging_.taken(*id);
    ++context_.changes;
    on_change();
    bool const is_there = co_await session->claimed();
    if (!is_there)
        co_return nullptr;
    ++context_.staged_taken;
    co_return session;
}

asio::awaitable<void> Stager::await_seat()
{
    auto const executor = co_await asio::this_coro::executor;
    auto& clock = context_.clock;
    auto const deadline = clock.now() + longest_end;
    auto const seats = static_cast<std::size_t>(context_.admission.max_simulations());
    while (context_.launcher.running() >= seats && staging_.seats() > 0 && clock.now() < deadline) {
        async::Wakeup freed(executor);
        auto const wait = seat_waits_.insert(seat_waits_.end(), &freed);
        auto parts = async::first_of(freed.wait(), clock.wait_until(deadline));
        (void)co_await std::move(parts);
        seat_waits_.erase(wait);
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return;
    }
}

void Stager::on_fetch(std::uint64_t id, Project const& project)
{
    if (project.website)
        return;
    staging_.fetched(id, project.revision);
    staging_.learned(project.ref.address(), project.revision);
    on_change();
}

void Stager::on_ready(std::uint64_t id)
{
    staging_.ready(id, context_.clock.now());
    on_change();
}

} // namespace webots_cloud
