// Relays bytes between browsers and other servers.
#pragma once

#include "adapters/network/connection_limit.hpp"
#include "async/wakeup.hpp"
#include "core/access/chunked_body.hpp"
#include "tunnel_end.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/time.hpp>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/steady_timer.hpp>

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::adapters {

/// What a tunnel begins with.
struct TunnelPlan
{
    static constexpr std::uint64_t until_the_end = UINT64_MAX;

    NetworkStream::Released browser;
    NetworkStream::Released upstream; ///< The other server's connection.
    std::string to_browser;           ///< Is sent before anything that is relayed.
    std::string to_upstream;          ///< As well.
    /// What the browser says is passed on, too. If not, it is not even read: it is the browser's next
    /// request.
    bool is_two_way = false;
    /// The other server's body goes to the browser in messages of a WebSocket, and whatever the browser says
    /// ends the tunnel.
    bool in_messages = false;
    /// After `length` bytes the other server's connection is given back, too.
    bool keeps_upstream = false;
    /// After this many bytes of the other server the browser's connection is free again.
    std::uint64_t length = until_the_end;
    /// Where the other server's body comes in chunks: how far it has come in `to_browser`. It ends with its
    /// last chunk, whatever follows.
    std::optional<core::ChunkedBody> chunks;
    std::shared_ptr<TunnelGroup> group;
    ConnectionLimit::Ticket ticket;
};

/// All tunnels of a server.
///
/// The kernel reports the events of tunnels to a queue of their own (epoll), of which the event loop knows
/// only that it is not empty: each turn moves a bounded number of bytes, however many tunnels have some, and
/// everybody else has a turn in between. So a tunnel needs neither operations of the event loop nor a
/// coroutine, and moving a chunk allocates nothing. Tunnels hold no buffers but for what the kernel did not
/// take; they share one.
///
/// Lifetime: `join` must have completed before it goes.   Thread-safety: one executor.
class Tunnels
{
public:
    class Tunnel;

    /// `params` and `statistics` must outlive it.
    Tunnels(boost::asio::any_io_executor executor, HttpServerParams const& params,
            HttpServerStatistics& statistics);
    ~Tunnels();

    /// Relays until both sides have ended.
    void open(TunnelPlan plan);

    /// What a tunnel leaves.
    struct Ends
    {
        NetworkStream::Released browser;
        NetworkStream::Released upstream; ///< Unless it has been closed there.
    };

    /// Relays `plan.length` bytes, and returns the connections, for the caller to close; none where either
    /// side, the group or we have ended it before. Meanwhile `tunnel` is set, and can be cut.
    boost::asio::awaitable<Ends> relay(TunnelPlan plan, Tunnel*& tunnel);
    void cut(Tunnel& tunnel);

    /// Those of `open`.
    std::size_t open_ended() const noexcept { return open_ended_; }

    /// That are in use, but for those of the connections that `relay` gives back.
    std::size_t descriptors() const noexcept { return tunnels_.size() + open_ended_; }

    /// Ends those that have been silent, or have not taken what they were sent, for too long.
    void check(TimePoint now);

    void cut_all();

    /// Waits until there is none. Afterwards none can be opened.
    boost::asio::awaitable<void> join();

private:
    using List = std::list<Tunnel>;

    bool start();
    Tunnel& add(TunnelPlan plan);
    void watch(Tunnel& tunnel);
    void schedule(Tunnel& tunnel);
    void arm();
    void await_events();
    void collect();
    void turn();
    void bury(Tunnel& tunnel);
    void pause(Tunnel& tunnel);

    boost::asio::any_io_executor executor_;
    HttpServerParams const& params_;
    HttpServerStatistics& statistics_;
    boost::asio::posix::stream_descriptor events_; ///< Of all tunnels.
    boost::asio::steady_timer pause_;
    List tunnels_;
    std::unique_ptr<char[]> scratch_;
    std::size_t left_of_turn_ = 0; ///< Bytes.
    std::vector<Tunnel*> ready_;   ///< May have something to do; each is there once.
    std::vector<Tunnel*> paused_;  ///< Over the limit of their groups.
    std::shared_ptr<bool> alive_ = std::make_shared<bool>(true);
    async::Wakeup ended_;
    std::size_t open_ended_ = 0;
    bool is_waiting_ = false;
    bool is_posted_ = false;
};

} // namespace webots_cloud::adapters
