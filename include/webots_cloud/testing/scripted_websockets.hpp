// A WebSocket client whose other side is the test.
#pragma once

#include <webots_cloud/testing/fuse.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/websocket_client.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::testing {

/// Reads like a timetable: `sockets.expect("ws://a:2000/client").after(2s).accept();` Then
/// `sockets.peer(0).says("webots:...")` is what the other side of the first channel does.
///
/// Steps for the same URL are taken in the order of the script; one with `always()` is repeated for ever. A
/// URL that is not in the script fails with a message that quotes the script.
/// Lifetime: `clock` must outlive it, and it its channels.
class ScriptedWebSockets final : public WebSocketClient
{
public:
    explicit ScriptedWebSockets(Clock& clock) : clock_(clock) {}

    /// How one handshake is answered.
    class Step
    {
    public:
        /// The handshake takes that long; requests with a shorter timeout get `timed_out`.
        Step& after(Duration delay);
        /// The other side accepts: so does a step of which nothing else is said.
        Step& accept();
        Step& fail(Failure failure);
        /// The other side never answers: the request waits for its timeout, or its cancellation.
        Step& hang();
        /// This step is taken for all further requests.
        Step& always();

    private:
        friend ScriptedWebSockets;

        Duration delay_{};
        result<> answer_;
        bool repeated_ = false;
    };

    /// The other side of an accepted channel; it stays when the channel is destroyed.
    class Peer
    {
    public:
        Peer(boost::asio::any_io_executor executor, WebSocketRequest request);

        void says(std::string text);         ///< A text longer than the request allows closes with 1009.
        void closes(std::uint16_t code = 0); ///< By a close frame.
        void is_lost();                      ///< The connection breaks without a close frame.
        /// From now on it takes nothing: what it is sent waits, until the channel is dropped since too much
        /// does.
        void stops_reading();

        WebSocketRequest const& request() const noexcept { return request_; }
        /// What it was sent, in order.
        std::vector<std::string> const& received() const noexcept { return channel_.sent; }
        /// True when it was sent a message that starts with `text`.
        bool was_told(std::string_view text) const { return channel_.was_told(text); }
        /// The code with which our side has closed the channel.
        std::optional<std::uint16_t> close_code() const noexcept { return channel_.close_code; }
        /// When the channel was destroyed. Before `close_code` has a value, and before the peer has closed,
        /// that breaks the connection without a close frame.
        std::optional<TimePoint> dropped_at() const noexcept { return dropped_at_; }

    private:
        friend ScriptedWebSockets;

        WebSocketRequest request_;
        LoopbackChannel channel_;
        bool reads_ = true;
        std::optional<TimePoint> dropped_at_;
    };

    /// What happens next to a request for `url`.
    Step& expect(std::string const& url);

    boost::asio::awaitable<result<std::unique_ptr<Channel>>> connect(WebSocketRequest request) override;

    /// All requests so far, in order, whatever became of them.
    std::vector<WebSocketRequest> const& requests() const noexcept { return requests_; }

    /// The accepted channels, in order.
    std::size_t accepted() const noexcept { return peers_.size(); }
    Peer& peer(std::size_t number) { return *peers_.at(number); }
    /// The latest one for `url`; it must be there.
    Peer& peer(std::string_view url);

    /// Expected requests that were not made, a line each; should be empty at the end of a test.
    std::string unused() const;

    Fuse fuse;

private:
    class OpenChannel;

    Clock& clock_;
    std::map<std::string, std::deque<Step>> script_;
    std::vector<WebSocketRequest> requests_;
    std::vector<std::shared_ptr<Peer>> peers_;
};

} // namespace webots_cloud::testing
