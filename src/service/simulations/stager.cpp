// The worlds that are staged are those of the configuration and then those that session servers want for
// their classes (`serve`). Once a second, and whenever something has changed, core::Staging says what is to
// be done: one staged simulation is begun, others are given back. The simulations are SimulationSessions,
// which clean up after themselves.
// Decisions: core/simulation/staging.
#include "stager.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "async/first_of.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/text.hpp"
#include "service/tell.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr auto look_interval = std::chrono::seconds(1);
// Between two looks whether plain folders have changed; more where a look takes long, since many files are
// looked at: then a fiftieth of the time of one thread.
constexpr Duration folder_interval = std::chrono::seconds(2);
constexpr int folder_share = 50;
// A simulator that is ended is killed after SimulationLauncherConfig::grace, which is shorter.
constexpr auto longest_end = std::chrono::seconds(10);
constexpr std::size_t most_wishers = 16;                       // session servers
constexpr auto wish_interval = std::chrono::milliseconds(500); // between two messages of one, on average
constexpr int wish_burst = 40;

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

/// The worlds of the configuration come first. One that is in both has the sum.
void Stager::apply()
{
    std::vector<core::StagedWorld> worlds;
    auto const add = [&worlds](std::string const& url, std::string address, std::string const& mode,
                               int count) {
        auto const same = std::find_if(worlds.begin(), worlds.end(), [&](auto const& world) {
            return world.address == address && core::is_video(world.mode) == core::is_video(mode);
        });
        if (same != worlds.end()) {
            same->count += count;
            return;
        }
        auto& world = worlds.emplace_back();
        world.url = url;
        world.address = std::move(address);
        world.mode = mode;
        world.count = count;
    };
    for (auto const& configured : context_.config.staged) {
        auto const parsed = context_.fetcher.parse(configured.url);
        if (!parsed)
            continue; // a program's own configuration; those of files have been checked
        add(configured.url, parsed->address(), configured.mode, configured.count);
    }
    // Session servers share what the operator allows for classes; whoever connected first comes first.
    int left = context_.config.staged_for_classes;
    for (auto const& [id, wisher] : wishers_)
        for (auto const& wish : wisher.wishes) {
            int const count = std::min(left, wish.wanted.count);
            if (count > 0 && !wish.address.empty())
                add(wish.wanted.url, wish.address, wish.wanted.mode, count);
            left -= wish.address.empty() ? 0 : count;
        }
    staging_.apply(std::move(worlds), context_.config.staged_max_age);
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
    for (auto const& [id, session] : sessions_)
        if (!session->is_staged() && context_.cores > 0)
            room.browsers += 100 * session->usage().processors() / context_.cores;
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
    // One at a time: `on_ready`, or the end of `prepare`, has us look again.
    auto const id = new_id_();
    staging_.begun(id, *plan.next, context_.clock.now());
    tasks_->spawn(prepare(id, request_for(staging_.worlds()[*plan.next])));
}

asio::awaitable<result<>> Stager::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    tasks_.emplace(executor);
    changed_.emplace(executor);
    auto parts = async::first_of(act_on_changes(), watch_folders());
    (void)co_await std::move(parts);
    // Staged simulations end with us, and their tasks refer to us. They clean up although we have been
    // cancelled.
    for (auto const& [id, session] : sessions_)
        session->give_back();
    co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
    co_await tasks_->join();
    co_return Failure(asio::error::operation_aborted);
}

asio::awaitable<result<>> Stager::act_on_changes()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto& clock = context_.clock;
    for (;;) {
        act();
        tell_wishers();
        // Where nothing is to be staged, the server is not woken each second.
        auto const next = staging_.is_idle() ? TimePoint::max() : clock.now() + look_interval;
        auto parts = async::first_of(changed_->wait(), clock.wait_until(next));
        auto const waited = co_await std::move(parts);
        bool const cancelled = co_await async::is_cancelled();
        if (!waited || cancelled)
            co_return Failure(asio::error::operation_aborted);
    }
}

/// What is new on a git server shows when somebody fetches it. When somebody changes a plain folder, nothing
/// is fetched.
asio::awaitable<result<>> Stager::watch_folders()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto& clock = context_.clock;
    Duration pause = folder_interval;
    for (;;) {
        auto const waited = co_await clock.wait_until(clock.now() + pause);
        bool const cancelled = co_await async::is_cancelled();
        if (!waited || cancelled)
            co_return Failure(asio::error::operation_aborted);
        auto const began = clock.now();
        auto const looked = co_await look_at_folders();
        if (!looked)
            co_return looked;
        pause = std::max(folder_interval, folder_share * (clock.now() - began));
    }
}

/// Errors: `operation_aborted`.
asio::awaitable<result<>> Stager::look_at_folders()
{
    // Copied: the list of worlds may change while we wait for a folder.
    std::vector<std::string> urls;
    for (auto const& world : staging_.worlds())
        if (staging_.ready_for(world.address, world.mode) > 0)
            urls.push_back(world.url);
    for (auto const& url : urls) {
        auto world = context_.fetcher.parse(url);
        if (!world)
            continue;
        auto const address = world->address();
        auto const revision = co_await context_.fetcher.current_revision(std::move(*world));
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return Failure(asio::error::operation_aborted);
        if (!revision)
            continue;
        staging_.learned(address, *revision);
        on_change();
    }
    co_return result<>();
}

/// Until it has ended, or a browser has it.
asio::awaitable<void> Stager::prepare(std::uint64_t id, core::SimulationRequest request)
{
    auto const executor = co_await asio::this_coro::executor;
    auto const session = std::make_shared<SimulationSession>(
        context_, executor, id, std::string(), std::move(request), SimulationSession::Browser::awaited);
    sessions_.emplace(id, session);
    co_await session->run_staged();
    // A browser has it now, whose connection removes it from the list.
    if (!session->is_over())
        co_return;
    staging_.ended(id, context_.clock.now());
    sessions_.erase(id);
    ++context_.changes;
    // The process has ended, so its port can be had again.
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
    // Before we wait, or the next browser would be offered the same one.
    staging_.taken(*id);
    ++context_.changes;
    count_taken(world->address(), start->mode);
    on_change();
    bool const is_there = co_await session->claimed();
    if (!is_there)
        co_return nullptr;
    ++context_.staged_taken;
    co_return session;
}

asio::awaitable<void> Stager::serve(std::uint64_t id, std::vector<core::StagingWish> wishes, Channel& channel)
{
    auto& clock = context_.clock;
    if (context_.config.staged_for_classes == 0 || wishers_.size() >= most_wishers) {
        tell_wrong_message(channel, "nothing more is staged here for classes", false);
        channel.close();
        co_return;
    }
    context_.log.info(LogCause("staged"),
                      concat("[", std::to_string(id), "] A session server has simulations staged"));
    // What it wants counts as long as it is connected: the connection is the lease, so nothing is left of a
    // session server that dies.
    auto& wisher = wishers_[id];
    wisher.channel = &channel;
    for (;;) {
        take_wishes(wisher, std::move(wishes));
        apply();
        wisher.told.clear(); // an answer shows that we live
        tell_wishers();
        auto const deadline = clock.now() + longest_silence;
        auto const text = co_await async::with_deadline(clock, deadline, channel.receive());
        // Silent for too long, or far too talkative: either way it is no session server that works.
        if (!text || !wisher.messages.take(clock.now(), wish_interval, wish_burst))
            break;
        auto message = core::parse_client_message(*text);
        auto* const stage = std::get_if<core::StageMessage>(&message);
        if (!stage)
            break;
        wishes = std::move(stage->wishes);
    }
    // What was staged for it is given back.
    wishers_.erase(id);
    apply();
    channel.close();
}

/// What was taken of a world that is still wanted stays counted.
void Stager::take_wishes(Wisher& wisher, std::vector<core::StagingWish> wishes) const
{
    auto const before = std::exchange(wisher.wishes, {});
    for (auto& wanted : wishes) {
        auto const known = std::find_if(before.begin(), before.end(), [&wanted](Wish const& wish) {
            return wish.wanted.url == wanted.url && wish.wanted.mode == wanted.mode;
        });
        auto& wish = wisher.wishes.emplace_back();
        if (known != before.end())
            wish = *known;
        else if (auto const parsed = context_.fetcher.parse(wanted.url);
                 parsed && core::is_known_mode(wanted.mode))
            wish.address = parsed->address();
        wish.wanted = std::move(wanted);
    }
}

/// The first session server that wants this world has one less to wait for: its student has come.
void Stager::count_taken(std::string const& address, std::string const& mode)
{
    for (auto& [id, wisher] : wishers_)
        for (auto& wish : wisher.wishes) {
            bool const is_same =
                wish.address == address && core::is_video(wish.wanted.mode) == core::is_video(mode);
            if (!is_same || wish.wanted.count == 0)
                continue;
            --wish.wanted.count;
            ++wish.taken;
            return apply();
        }
}

/// What is ready of a world that several want is first counted for those that came first.
void Stager::tell_wishers()
{
    std::map<std::pair<std::string, bool>, int> counted;
    for (auto& [id, wisher] : wishers_) {
        std::vector<core::StagedFigure> figures;
        for (auto const& wish : wisher.wishes) {
            auto& others = counted[{wish.address, core::is_video(wish.wanted.mode)}];
            auto& figure = figures.emplace_back();
            figure.url = wish.wanted.url;
            figure.mode = wish.wanted.mode;
            figure.taken = wish.taken;
            figure.ready =
                std::min(wish.wanted.count, staging_.ready_for(wish.address, wish.wanted.mode) - others);
            others += figure.ready;
        }
        auto text = core::staged_message(figures);
        if (text != wisher.told)
            (void)wisher.channel->send(text);
        wisher.told = std::move(text);
    }
}

asio::awaitable<void> Stager::await_seat()
{
    auto const executor = co_await asio::this_coro::executor;
    auto& clock = context_.clock;
    auto const deadline = clock.now() + longest_end;
    auto const seats = static_cast<std::size_t>(context_.admission.max_simulations());
    // A simulator holds its port until its process has ended, even if it no longer has a seat. Without this
    // wait a launch would find no port, and the browser would be refused.
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
