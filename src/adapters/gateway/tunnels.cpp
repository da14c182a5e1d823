// Shares the event loop among all tunnels: in each turn they move a bounded number of bytes together, one
// tunnel after the other. They have an epoll set of their own, so that an idle one costs next to nothing
// (decision 011). One tunnel is in tunnel.cpp.
#include "tunnel.hpp"

#include <boost/asio/post.hpp>

#include <algorithm>
#include <array>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <utility>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

namespace {

// What all tunnels may move in a turn. Others have theirs after two at most, one that was posted and one that
// an event began: less than 2 ms, with TLS.
constexpr std::size_t max_bytes_per_turn = 512 * 1024;
// What a tunnel with little to move costs, compared with one that moves bytes.
constexpr std::size_t cost_of_a_look = 8 * 1024;
constexpr int max_events = 128; // taken from the kernel at once

// Of a peer that has vanished without a word the kernel tells after two minutes.
constexpr int keepalive_idle = 60;
constexpr int keepalive_interval = 15;
constexpr int keepalive_probes = 4;

void keep_alive(int descriptor)
{
    int const on = 1;
    (void)::setsockopt(descriptor, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof on);
    (void)::setsockopt(descriptor, IPPROTO_TCP, TCP_KEEPIDLE, &keepalive_idle, sizeof keepalive_idle);
    (void)::setsockopt(descriptor, IPPROTO_TCP, TCP_KEEPINTVL, &keepalive_interval,
                       sizeof keepalive_interval);
    (void)::setsockopt(descriptor, IPPROTO_TCP, TCP_KEEPCNT, &keepalive_probes, sizeof keepalive_probes);
}

} // namespace

Tunnels::Tunnels(asio::any_io_executor executor, HttpServerParams const& params,
                 HttpServerStatistics& statistics)
    : executor_(std::move(executor)), params_(params), statistics_(statistics), events_(executor_),
      pause_(executor_), ended_(executor_)
{}

Tunnels::~Tunnels()
{
    *alive_ = false;
}

/// The queue of events and the buffer are made for the first tunnel.
bool Tunnels::start()
{
    if (events_.is_open())
        return true;
    scratch_ = std::make_unique_for_overwrite<char[]>(Tunnel::chunk_size);
    int const queue = ::epoll_create1(EPOLL_CLOEXEC);
    boost::system::error_code error;
    if (queue >= 0)
        events_.assign(queue, error);
    return queue >= 0 && !error;
}

Tunnels::Tunnel& Tunnels::add(TunnelPlan plan)
{
    bool const lasts = plan.length == TunnelPlan::until_the_end;
    auto& tunnel = tunnels_.emplace_back(*this, std::move(plan));
    tunnel.self = std::prev(tunnels_.end());
    tunnel.last_moved = std::chrono::steady_clock::now();
    if (lasts) {
        keep_alive(tunnel.browser().end.descriptor());
        keep_alive(tunnel.upstream().end.descriptor());
    }
    bool watched = start();
    for (auto* const side : {&tunnel.browser(), &tunnel.upstream()}) {
        epoll_event event{};
        event.events = EPOLLIN | EPOLLOUT | EPOLLRDHUP | EPOLLET;
        // The lowest bit says which side it is.
        event.data.u64 = reinterpret_cast<std::uintptr_t>(&tunnel) | (side == &tunnel.upstream() ? 1U : 0U);
        watched = watched &&
                  ::epoll_ctl(events_.native_handle(), EPOLL_CTL_ADD, side->end.descriptor(), &event) == 0;
    }
    // Nothing would tell us of its bytes: it ends in its first turn.
    if (!watched)
        tunnel.end();
    schedule(tunnel);
    await_events();
    return tunnel;
}

void Tunnels::open(TunnelPlan plan)
{
    ++open_ended_;
    add(std::move(plan));
}

asio::awaitable<Tunnels::Ends> Tunnels::relay(TunnelPlan plan, Tunnel*& tunnel)
{
    async::Wakeup done(executor_);
    Ends ends;
    tunnel = &add(std::move(plan));
    tunnel->outcome = &ends;
    tunnel->done = &done;
    tunnel->handle = &tunnel;
    (void)co_await done.wait();
    co_return ends;
}

void Tunnels::cut(Tunnel& tunnel)
{
    tunnel.end();
}

/// Gives the tunnel a turn, soon.
void Tunnels::schedule(Tunnel& tunnel)
{
    if (tunnel.is_scheduled)
        return;
    tunnel.is_scheduled = true;
    ready_.push_back(&tunnel);
    arm();
}

void Tunnels::arm()
{
    if (is_posted_)
        return;
    is_posted_ = true;
    asio::post(executor_, [this, alive = alive_] {
        if (!*alive)
            return;
        is_posted_ = false;
        turn();
    });
}

void Tunnels::await_events()
{
    if (is_waiting_ || !events_.is_open() || tunnels_.empty())
        return;
    is_waiting_ = true;
    events_.async_wait(asio::posix::stream_descriptor::wait_read,
                       [this, alive = alive_](boost::system::error_code error) {
                           if (error || !*alive)
                               return;
                           is_waiting_ = false;
                           if (!is_posted_)
                               turn();
                       });
}

/// Notes what the kernel has to tell.
void Tunnels::collect()
{
    std::array<epoll_event, max_events> events;
    int const count =
        events_.is_open() ? ::epoll_wait(events_.native_handle(), events.data(), max_events, 0) : 0;
    for (int i = 0; i < count; ++i) {
        auto const& event = events[static_cast<std::size_t>(i)];
        auto* const tunnel = reinterpret_cast<Tunnel*>(event.data.u64 & ~std::uint64_t{1});
        auto& side = (event.data.u64 & 1U) != 0 ? tunnel->upstream() : tunnel->browser();
        side.end.notice(event.events);
        if (!tunnel->is_scheduled) {
            tunnel->is_scheduled = true;
            ready_.push_back(tunnel);
        }
    }
}

/// A bounded amount of work.
void Tunnels::turn()
{
    collect();
    std::size_t work = 0;
    std::size_t done = 0;
    // As many as there are now: those that want another turn, and what comes meanwhile, wait for the next
    // one, and the rest of the event loop has its own in between.
    for (auto const count = ready_.size(); done < count && work < max_bytes_per_turn; ++done) {
        auto& tunnel = *ready_[done];
        tunnel.is_scheduled = false;
        std::size_t moved = 0;
        left_of_turn_ = max_bytes_per_turn - work;
        auto const next = tunnel.step(moved);
        work += cost_of_a_look + moved;
        if (moved > 0)
            tunnel.has_moved = true;
        switch (next) {
        case Tunnel::Step::wait:
            break;
        case Tunnel::Step::again:
            tunnel.is_scheduled = true;
            ready_.push_back(&tunnel);
            break;
        case Tunnel::Step::pause:
            pause(tunnel);
            break;
        case Tunnel::Step::over:
            bury(tunnel);
            break;
        }
    }
    // Tunnels that had no share of this turn stay in front.
    ready_.erase(ready_.begin(), ready_.begin() + static_cast<std::ptrdiff_t>(done));
    if (!ready_.empty())
        arm();
    else
        await_events();
}

void Tunnels::pause(Tunnel& tunnel)
{
    // One timer for all: a tunnel that comes while it runs is woken early, and asks again.
    bool const is_first = paused_.empty();
    if (std::find(paused_.begin(), paused_.end(), &tunnel) == paused_.end())
        paused_.push_back(&tunnel);
    if (!is_first)
        return;
    pause_.expires_after(TunnelGroup::pause);
    pause_.async_wait([this, alive = alive_](boost::system::error_code) {
        if (!*alive)
            return;
        auto paused = std::move(paused_);
        paused_.clear();
        for (auto* const each : paused)
            schedule(*each);
    });
}

void Tunnels::bury(Tunnel& tunnel)
{
    std::erase(paused_, &tunnel);
    // An event carries the address of its tunnel, and the connection may live on without it.
    for (auto* const side : {&tunnel.browser(), &tunnel.upstream()})
        if (events_.is_open())
            (void)::epoll_ctl(events_.native_handle(), EPOLL_CTL_DEL, side->end.descriptor(), nullptr);
    if (tunnel.outcome && tunnel.is_complete()) {
        tunnel.outcome->browser = tunnel.browser().end.release();
        if (tunnel.keeps_upstream())
            tunnel.outcome->upstream = tunnel.upstream().end.release();
    }
    if (tunnel.done) {
        *tunnel.handle = nullptr; // before the other side's next turn, in which it may be cut
        tunnel.done->notify();
    } else {
        --open_ended_;
    }
    tunnels_.erase(tunnel.self);
    if (tunnels_.empty())
        ended_.notify();
}

void Tunnels::check(TimePoint now)
{
    for (auto& tunnel : tunnels_) {
        if (std::exchange(tunnel.has_moved, false))
            tunnel.last_moved = now;
        if (!tunnel.is_cut() && tunnel.is_overdue(now, params_)) {
            ++statistics_.timed_out;
            tunnel.end();
        }
    }
}

void Tunnels::cut_all()
{
    for (auto& tunnel : tunnels_)
        tunnel.end();
}

asio::awaitable<void> Tunnels::join()
{
    while (!tunnels_.empty())
        (void)co_await ended_.wait();
    boost::system::error_code ignored;
    events_.close(ignored);
    pause_.cancel();
}

} // namespace webots_cloud::adapters
