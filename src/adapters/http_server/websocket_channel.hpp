// A Channel over a connection on which the opening handshake has been answered.
#pragma once

#include "adapters/messages/websocket_frames.hpp"
#include "adapters/network/network_stream.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/steady_timer.hpp>

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// Reads ahead a little, writes in order from a bounded queue, answers pings, pings silent peers and drops
/// dead ones.
///
/// Holds no buffer while nothing happens: what comes is read into one that all channels of a thread share.
/// Lifetime: `finish()` must have completed before it is destroyed.   Thread-safety: one executor.
class WebSocketChannel final : public Channel
{
public:
    /// `params` and `statistics` must outlive it.
    WebSocketChannel(NetworkStream stream, HttpServerParams const& params, HttpServerStatistics& statistics);

    /// Begins to read; `received` came together with the handshake.
    void start(std::string_view received);

    result<> send(std::string text) override { return send_all({&text, 1}); }
    result<> send_all(std::span<std::string const> texts) override; // by one write
    boost::asio::awaitable<result<std::string>> receive() override;
    void close(std::uint16_t code = 0, std::string reason = {}) override;
    std::size_t queued() noexcept override;
    std::uint16_t farewell() const noexcept override { return farewell_; }

    /// Closes, and waits until no operation is pending. Not cancellable.
    boost::asio::awaitable<void> finish();

    /// Gives up at once: the connection is cut, what was queued is lost.
    void cut();

    /// Closed by us, but not by the browser yet.
    bool awaits_farewell() const noexcept { return closing_ && !close_received_ && !lost_; }

    /// Sends pings and closes connections when they are due: to be called about once a second.
    void check(TimePoint now);

private:
    void await_bytes();
    void read();
    void read_on();
    void take(std::string_view bytes);
    std::string take_message();
    void obey(WebSocketEvent event);
    void write();
    void written();
    void begin_close(std::uint16_t code, std::string_view reason);
    bool is_full() const noexcept;
    std::string why_lost() const;
    bool awaits_pong() const noexcept { return !closing_ && deadline_ != TimePoint::max(); }
    void notify() { changed_.cancel(); }

    // What `send` uses, kept close together: a message may go to thousands of channels at once.
    std::string outgoing_; ///< Frames, whole but for the first, of which a part may be sent.
    HttpServerParams const& params_;
    bool awaiting_read_ = false;
    bool awaiting_write_ = false;
    bool closing_ = false;        ///< The close frame is queued: nothing may follow it.
    bool close_received_ = false; ///< The browser's close frame has come.
    bool broken_ = false;        ///< The browser broke the protocol: what it says is not understood any more.
    bool lost_ = false;          ///< The connection has ended.
    bool silent_ = false;        ///< It was ended since the browser did not answer.
    std::uint16_t farewell_ = 0; ///< The code of its close frame.
    NetworkStream stream_;

    HttpServerStatistics& statistics_;
    TimePoint last_heard_;
    TimePoint last_pinged_ = TimePoint::min();
    TimePoint deadline_ =
        TimePoint::max(); ///< For the end, once the channel is closing; before, for an answer to our ping.
    WebSocketFrameReader frames_;
    std::vector<std::string> received_;   ///< Messages that the caller has not received yet.
    std::unique_ptr<std::string> unread_; ///< Bytes behind those messages; null most of the time.
    boost::asio::steady_timer changed_;   ///< Never expires: `notify` cancels it to wake its waiters.
};

} // namespace webots_cloud::adapters
