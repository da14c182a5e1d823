#include "tunnels.hpp"

#include <boost/asio/post.hpp>

#include <algorithm>
#include <array>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

namespace {

// What is read at once when there is much: all that a simulator has sent since the last look, as a rule. Each
// piece that is sent on wakes the browser, and each that is taken the simulator, which costs as much as
// copying.
constexpr std::size_t chunk_size = 256 * 1024;
// The same of a side that does not take that much: what it leaves has been copied in vain.
constexpr std::size_t modest_chunk = 64 * 1024;
// The same of what comes by TLS: it has left the kernel, and what the other side leaves of it is kept.
constexpr std::size_t tls_chunk = 64 * 1024;
// What is read before it is known whether the other side takes it.
constexpr std::size_t small_chunk = 16 * 1024;
// What all tunnels may move before others have their turn: less than 2 ms, with TLS.
constexpr std::size_t max_bytes_per_turn = 1024 * 1024;
// What a tunnel with little to move costs, compared with one that moves bytes.
constexpr std::size_t cost_of_a_look = 8 * 1024;
constexpr int max_events = 128;
// An event gets its turn at once if the last turn is longer ago than this. Otherwise others come first, and
// what happens meanwhile shares that turn.
constexpr auto turn_at_once_after = std::chrono::milliseconds(1);

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

/// One browser and its connection to another server.
class Tunnels::Tunnel final : public TunnelGroup::Tunnel
{
public:
    struct Side
    {
        explicit Side(NetworkStream::Released connection) noexcept : end(std::move(connection)) {}

        TunnelEnd end;
        std::string pending;            ///< To be sent there before anything else.
        bool is_over = false;           ///< Nothing more comes from there.
        bool is_bulk = false;           ///< The last read gave much.
        std::size_t takes = chunk_size; ///< Of a large chunk, to judge by the last one.
    };

    enum class Step
    {
        wait,  ///< For an event.
        again, ///< There is more to do at once.
        pause, ///< The group has moved what it may.
        over
    };

    Tunnel(Tunnels& owner, TunnelPlan plan)
        : owner_(owner), browser_(std::move(plan.browser)), upstream_(std::move(plan.upstream)),
          group_(std::move(plan.group)), ticket_(std::move(plan.ticket)), rest_(plan.length),
          is_two_way_(plan.is_two_way), keeps_upstream_(plan.keeps_upstream)
    {
        browser_.pending = std::move(plan.to_browser);
        upstream_.pending = std::move(plan.to_upstream);
        take_from_rest(0);
        upstream_.is_bulk = is_long();
        is_cut_ = group_ && !group_->join(*this);
    }
    Tunnel(Tunnel const&) = delete;
    Tunnel& operator=(Tunnel const&) = delete;
    ~Tunnel() { leave(); }

    void end() override
    {
        is_cut_ = true;
        owner_.schedule(*this);
    }

    bool is_cut() const noexcept { return is_cut_; }

    /// Moves a chunk in each direction at most; `moved` is how much that was.
    Step step(std::size_t& moved);

    /// Silent, or stuck, for too long.
    bool is_overdue(TimePoint now, HttpServerParams const& params) const noexcept;

    void leave() noexcept
    {
        if (group_)
            group_->leave(*this);
        group_.reset();
    }

    Side& browser() noexcept { return browser_; }
    Side& upstream() noexcept { return upstream_; }

    /// The browser has got all that it was to get, and its connection is its own again.
    bool is_complete() const noexcept { return rest_ == 0 && browser_.pending.empty() && !is_cut_; }

    List::iterator self;
    bool is_scheduled = false;
    TimePoint last_moved{};
    /// Whether the other server's connection is to live on as well, and does.
    bool keeps_upstream() const noexcept { return keeps_upstream_ && !upstream_.end.has_hung_up(); }

    // Of `relay`; null: of `open`.
    Ends* outcome = nullptr;
    async::Wakeup* done = nullptr;
    Tunnel** handle = nullptr; ///< Points here as long as there is a tunnel.

private:
    bool is_counted() const noexcept { return rest_ != TunnelPlan::until_the_end; }
    /// It is known that there is much to come.
    bool is_long() const noexcept { return is_counted() && rest_ > small_chunk; }
    void take_from_rest(std::uint64_t bytes) noexcept
    {
        if (!is_counted())
            return;
        rest_ -= bytes;
        upstream_.is_over = upstream_.is_over || rest_ == 0;
    }
    std::size_t flush(Side& to);
    Step relay(Side& from, Side& to, std::size_t& moved);
    void count(Side const& to, std::size_t bytes) noexcept;
    void drain_browser() noexcept;

    Tunnels& owner_;
    Side browser_;
    Side upstream_;
    std::shared_ptr<TunnelGroup> group_;
    ConnectionLimit::Ticket ticket_;
    std::uint64_t rest_;
    bool is_two_way_;
    bool keeps_upstream_;
    bool is_cut_ = false;
};

void Tunnels::Tunnel::count(Side const& to, std::size_t bytes) noexcept
{
    bool const is_sent = &to == &browser_;
    auto& statistics = owner_.statistics_;
    (is_sent ? statistics.tunnel_bytes_sent : statistics.tunnel_bytes_received) += bytes;
    if (!group_)
        return;
    if (is_sent)
        group_->count_sent(bytes);
    else
        group_->count_received(bytes);
}

/// Sends what is pending; how much of it.
std::size_t Tunnels::Tunnel::flush(Side& to)
{
    if (to.pending.empty() || !to.end.may_write())
        return 0;
    auto const sent = to.end.write(to.pending);
    count(to, sent);
    if (sent == to.pending.size())
        to.pending = std::string(); // and its memory
    else
        to.pending.erase(0, sent);
    return sent;
}

/// Moves a chunk from one side to the other.
Tunnels::Tunnel::Step Tunnels::Tunnel::relay(Side& from, Side& to, std::size_t& moved)
{
    moved += flush(to);
    if (to.end.is_broken())
        to.pending = std::string(); // nobody is there to take it
    if (!to.pending.empty())
        return Step::wait;
    if (from.is_over) {
        if (!is_counted()) // else the browser's connection lives on, or is cut
            to.end.shut_down();
        return Step::wait;
    }
    if (!from.end.may_read() || (!to.end.may_write() && !to.end.is_broken()))
        return Step::wait;
    auto size = !from.is_bulk ? small_chunk : from.end.is_tls() ? std::min(to.takes, tls_chunk) : to.takes;
    if (group_)
        size = std::min(size, group_->allowance(owner_.now_));
    if (size == 0)
        return Step::pause;
    auto const left = owner_.left_of_turn_ - std::min(owner_.left_of_turn_, moved);
    size = std::min(size, std::max(left, small_chunk));
    bool const is_counted_side = is_counted() && &from == &upstream_;
    if (is_counted_side)
        size = static_cast<std::size_t>(std::min<std::uint64_t>(size, rest_));
    // Bytes are taken out of the kernel after they have been sent on. So what the other side does not take
    // stays there, not with us; and the acknowledgement, which the kernel sends when bytes are taken out,
    // does not delay them.
    bool const peek = !from.end.is_tls() && !to.end.is_broken();
    std::size_t got = 0;
    auto* const bytes = owner_.scratch_.get();
    auto const reading = from.end.read(bytes, size, peek, got);
    if (reading == TunnelEnd::Reading::nothing)
        return Step::wait;
    if (reading == TunnelEnd::Reading::over) {
        from.is_over = true;
        return Step::again;
    }
    std::size_t sent = got;
    if (!to.end.is_broken()) {
        sent = to.end.write(std::string_view(bytes, got));
        count(to, sent);
        moved += sent;
        // Who does not take it all is offered less: of TLS no more than a record, which we keep.
        auto const least = from.end.is_tls() ? small_chunk : modest_chunk;
        if (size > small_chunk || from.end.is_tls())
            to.takes = std::clamp(sent < got ? 2 * sent : 2 * to.takes, least, chunk_size);
        // TLS has begun to send a record, and must be given the same bytes again.
        auto const kept = !peek ? got - sent : to.end.is_tls() ? std::min(got - sent, small_chunk) : 0;
        to.pending.assign(bytes + sent, kept);
        sent += kept;
    }
    if (peek)
        from.end.discard(bytes, sent, sent == got && got < size);
    if (is_counted_side)
        take_from_rest(sent);
    from.is_bulk = got >= small_chunk || (is_counted_side && is_long());
    bool const is_taken = to.pending.empty() && (to.end.may_write() || to.end.is_broken());
    return is_taken && (from.is_over || from.end.may_read()) ? Step::again : Step::wait;
}

/// What a browser still says when it has got all: unread, it would reset the connection.
void Tunnels::Tunnel::drain_browser() noexcept
{
    std::size_t got = 0;
    while (browser_.end.may_read() && !browser_.is_over)
        browser_.is_over =
            browser_.end.read(owner_.scratch_.get(), chunk_size, false, got) == TunnelEnd::Reading::over;
}

Tunnels::Tunnel::Step Tunnels::Tunnel::step(std::size_t& moved)
{
    if (is_cut_)
        return Step::over;
    auto next = relay(upstream_, browser_, moved);
    if (browser_.end.is_broken())
        return Step::over;
    if (is_counted())
        return is_complete() || (upstream_.is_over && rest_ > 0) ? Step::over : next;
    if (is_two_way_) {
        auto const other = relay(browser_, upstream_, moved);
        next = next == Step::again || other == Step::again   ? Step::again
               : next == Step::pause || other == Step::pause ? Step::pause
                                                             : Step::wait;
    } else {
        moved += flush(upstream_);
        if (browser_.end.is_shut_down())
            drain_browser();
        else if (browser_.end.has_hung_up())
            upstream_.end.shut_down();
    }
    bool const is_over = upstream_.is_over && browser_.is_over && browser_.end.is_shut_down() &&
                         (upstream_.pending.empty() || upstream_.end.is_broken());
    return is_over ? Step::over : next;
}

bool Tunnels::Tunnel::is_overdue(TimePoint now, HttpServerParams const& params) const noexcept
{
    bool const is_stuck = !browser_.pending.empty() || !upstream_.pending.empty() ||
                          !browser_.end.may_write() || !upstream_.end.may_write();
    bool const is_half_closed = upstream_.is_over || browser_.is_over || upstream_.end.is_shut_down();
    auto const patience = is_stuck || is_half_closed ? params.write_timeout : params.tunnel_idle_timeout;
    return now - last_moved >= patience;
}

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
    scratch_ = std::make_unique_for_overwrite<char[]>(chunk_size);
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
                           if (!is_posted_ && std::chrono::steady_clock::now() - now_ >= turn_at_once_after)
                               turn();
                           else
                               arm();
                       });
}

/// Notes what the kernel has to tell; how many events there were.
std::size_t Tunnels::collect()
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
    return count > 0 ? static_cast<std::size_t>(count) : 0;
}

/// A bounded amount of work.
void Tunnels::turn()
{
    auto const seen = collect();
    now_ = std::chrono::steady_clock::now();
    std::size_t work = 0;
    std::size_t done = 0;
    for (auto const count = ready_.size(); done < count && work < max_bytes_per_turn; ++done) {
        auto& tunnel = *ready_[done];
        tunnel.is_scheduled = false;
        std::size_t moved = 0;
        left_of_turn_ = max_bytes_per_turn - work;
        auto const next = tunnel.step(moved);
        work += cost_of_a_look + moved;
        if (moved > 0)
            tunnel.last_moved = now_;
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
    ready_.erase(ready_.begin(), ready_.begin() + static_cast<std::ptrdiff_t>(done));
    if (!ready_.empty() || seen == max_events)
        arm();
    else
        await_events();
}

void Tunnels::pause(Tunnel& tunnel)
{
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
    for (auto& tunnel : tunnels_)
        if (!tunnel.is_cut() && tunnel.is_overdue(now, params_)) {
            ++statistics_.timed_out;
            tunnel.end();
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
