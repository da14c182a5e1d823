// One task for each machine polls it on its own schedule, so that a slow one delays no other. Changes are
// kept until somebody takes them (`next_events`).
// Decisions: core/load/load_table.
#include <webots_cloud/load_monitor.hpp>

#include "async/cancellation.hpp"
#include "async/task_group.hpp"
#include "core/load/load_table.hpp"
#include "core/text.hpp"
#include "machine_request.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <unordered_map>
#include <unordered_set>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

// Where nobody takes them for long, the oldest go.
constexpr std::size_t max_events = 100'000;

// Polls that are due within the same 20 ms are sent together: with 5,000 servers a timer then expires for
// twenty polls at once.
constexpr Duration moment = std::chrono::milliseconds(20);

/// The polls of one server. Shared with their task, which may still run for a moment after the server was
/// removed.
struct Watch
{
    explicit Watch(ServerSpec polled) : server(std::move(polled)) {}

    ServerSpec server;
    int polls = 0;    ///< In flight.
    double phase = 0; ///< Where in the interval its polls lie, from 0 to 1.
    bool removed = false;
    std::optional<async::TaskGroup::Task> task;
};

result<LoadReport> judge(result<HttpResponse> const& response, bool must_be_ours)
{
    if (!response)
        return response.error();
    if (response->status != 200)
        return Failure(errc::protocol_error,
                       core::concat("answered HTTP ", std::to_string(response->status)));
    auto report = parse_load_report(response->body);
    if (report && must_be_ours && !report->arrivals)
        return Failure(errc::protocol_error, "it is not a simulation server of webots_cloud");
    return report;
}

result<> validate(LoadMonitorParams const& params)
{
    if (params.interval <= Duration::zero() || params.timeout <= Duration::zero())
        return Failure(errc::invalid_argument, "the interval and the timeout of polls must be positive");
    if (!std::isfinite(params.threshold) || params.threshold <= 0)
        return Failure(errc::invalid_argument, "threshold: wanted a positive percentage");
    return {};
}

bool was_aborted(result<HttpResponse> const& response)
{
    return !response && response.error().code() == asio::error::operation_aborted;
}

} // namespace

std::string server_url(std::string_view address, bool tls, std::string_view path)
{
    return core::concat(tls ? "https://" : "http://", address, path);
}

struct LoadMonitor::Impl final : FleetObserver
{
    Impl(LoadMonitorParams parameters, HttpClient& client, Clock& time)
        : params(parameters), http(client), clock(time)
    {}

    void start(std::shared_ptr<Watch> const& watch)
    {
        // Multiples of the golden ratio are spread evenly, however many there are.
        watch->phase = std::fmod(static_cast<double>(++started) * 0.6180339887, 1.0);
        watch->task = tasks->spawn(keep_polling(watch));
    }

    asio::awaitable<result<>> run();
    asio::awaitable<result<std::vector<LoadEvent>>> next_events();
    asio::awaitable<void> keep_polling(std::shared_ptr<Watch> watch);
    asio::awaitable<void> poll_once(std::shared_ptr<Watch> watch);
    void poll_now(std::string_view address);
    HttpRequest load_request(Watch const& watch) const;
    void record(Watch const& watch, result<LoadReport> const& outcome);
    void put_server(ServerSpec const& server, std::optional<std::string_view> before);
    void remove_server(std::string_view address);
    void put(FleetMachine const& machine, FleetMachine const*,
             std::optional<std::string_view> before) override
    {
        put_server(machine.spec, before);
    }
    void remove(FleetMachine const& machine) override { remove_server(machine.spec.address); }

    LoadMonitorParams params;
    HttpClient& http;
    Clock& clock;
    core::LoadTable table;
    /// One for each server of the table, by its address.
    std::unordered_map<std::string, std::shared_ptr<Watch>, core::TextHash, std::equal_to<>> watches;
    std::deque<LoadEvent> events;
    std::optional<async::TaskGroup> tasks; // while run() is awaited
    std::optional<async::Wakeup> happened;
    std::uint64_t started = 0;
};

asio::awaitable<void> LoadMonitor::Impl::keep_polling(std::shared_ptr<Watch> watch)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const began = clock.now();
    // The first poll is made at once, so that a machine that has just come is known. From the second on,
    // polls of all machines are spread over the interval.
    auto due = began + std::chrono::duration_cast<Duration>(params.interval * watch->phase);
    due -= due.time_since_epoch() % moment;
    while (!watch->removed) {
        ++watch->polls;
        auto const response = co_await http.send(load_request(*watch));
        --watch->polls;
        bool const cancelled = co_await async::is_cancelled();
        if (watch->removed || cancelled || was_aborted(response))
            break;
        record(*watch, judge(response, watch->server.has_own_path));
        // Polls that were missed while one took long are not made up for.
        due = std::max(due, clock.now());
        auto const waited = co_await clock.wait_until(due);
        bool const cancelled_meanwhile = co_await async::is_cancelled();
        if (!waited || cancelled_meanwhile)
            break;
        due += params.interval;
    }
    watch->task.reset();
}

HttpRequest LoadMonitor::Impl::load_request(Watch const& watch) const
{
    auto request = machine_request(watch.server, params, "/load");
    request.headers.emplace_back("Accept", "application/json, text/plain;q=0.5");
    return request;
}

/// Besides those of `keep_polling`, which know nothing of it.
asio::awaitable<void> LoadMonitor::Impl::poll_once(std::shared_ptr<Watch> watch)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const response = co_await http.send(load_request(*watch));
    --watch->polls;
    bool const cancelled = co_await async::is_cancelled();
    if (!watch->removed && !cancelled && !was_aborted(response))
        record(*watch, judge(response, watch->server.has_own_path));
}

void LoadMonitor::Impl::poll_now(std::string_view address)
{
    auto const found = watches.find(address);
    if (!tasks || found == watches.end() || found->second->polls != 0)
        return;
    ++found->second->polls;
    tasks->spawn(poll_once(found->second));
}

void LoadMonitor::Impl::record(Watch const& watch, result<LoadReport> const& outcome)
{
    events.push_back(table.record(watch.server.address, outcome, params.threshold, clock.now()));
    if (events.size() > max_events)
        events.pop_front();
    if (happened)
        happened->notify();
}

LoadMonitor::LoadMonitor(HttpClient& http, Clock& clock)
    : LoadMonitor(std::make_unique<Impl>(LoadMonitorParams(), http, clock))
{}

LoadMonitor::LoadMonitor(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

result<LoadMonitor> LoadMonitor::make(LoadMonitorParams params, HttpClient& http, Clock& clock)
{
    if (auto const usable = validate(params); !usable)
        return usable.error();
    return LoadMonitor(std::make_unique<Impl>(params, http, clock));
}

LoadMonitor::~LoadMonitor() = default;
LoadMonitor::LoadMonitor(LoadMonitor&&) noexcept = default;
LoadMonitor& LoadMonitor::operator=(LoadMonitor&&) noexcept = default;

result<> LoadMonitor::apply(LoadMonitorParams params)
{
    if (auto const usable = validate(params); !usable)
        return usable;
    impl_->params = params;
    return {};
}

LoadMonitorParams const& LoadMonitor::params() const noexcept
{
    return impl_->params;
}

void LoadMonitor::follow(Fleet& fleet)
{
    fleet.add_observer(*impl_);
}

void LoadMonitor::set_servers(std::vector<std::string> const& addresses)
{
    std::unordered_set<std::string_view> listed;
    for (auto const& address : addresses)
        if (listed.insert(address).second)
            impl_->put_server(ServerSpec(address), std::string_view());
    // Those that are listed stand at the end now, behind those that are not.
    while (impl_->table.servers().size() > listed.size())
        impl_->remove_server(impl_->table.servers().front().address);
}

void LoadMonitor::Impl::put_server(ServerSpec const& server, std::optional<std::string_view> before)
{
    if (!table.put(server.address, before)) {
        watches.find(server.address)->second->server = server;
        return;
    }
    auto const watch = std::make_shared<Watch>(server);
    watches.emplace(server.address, watch);
    if (tasks)
        start(watch);
}

void LoadMonitor::Impl::remove_server(std::string_view address)
{
    auto const found = watches.find(address);
    if (found == watches.end())
        return;
    auto const watch = found->second;
    table.remove(address);
    watches.erase(found);
    watch->removed = true;
    if (watch->task)
        async::TaskGroup::cancel(*watch->task);
}

asio::awaitable<result<>> LoadMonitor::run()
{
    return impl_->run();
}

asio::awaitable<result<std::vector<LoadEvent>>> LoadMonitor::next_events()
{
    return impl_->next_events();
}

asio::awaitable<result<>> LoadMonitor::Impl::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    tasks.emplace(executor);
    if (!happened)
        happened.emplace(executor);
    for (auto const& server : table.servers())
        start(watches.at(server.address));
    auto const ended = co_await async::until_cancelled();
    co_await tasks->end();
    tasks.reset();
    co_return ended;
}

asio::awaitable<result<std::vector<LoadEvent>>> LoadMonitor::Impl::next_events()
{
    if (!happened)
        happened.emplace(co_await asio::this_coro::executor);
    while (events.empty()) {
        auto const woken = co_await happened->wait();
        if (!woken)
            co_return woken.error();
    }
    std::vector<LoadEvent> taken(std::make_move_iterator(events.begin()),
                                 std::make_move_iterator(events.end()));
    events.clear();
    co_return taken;
}

void LoadMonitor::poll_now(std::string_view address)
{
    impl_->poll_now(address);
}

LoadTotals LoadMonitor::totals() const noexcept
{
    return impl_->table.totals();
}

std::list<ServerLoad> const& LoadMonitor::servers() const noexcept
{
    return impl_->table.servers();
}

ServerLoad const* LoadMonitor::find(std::string_view address) const
{
    return impl_->table.find(address);
}

} // namespace webots_cloud
