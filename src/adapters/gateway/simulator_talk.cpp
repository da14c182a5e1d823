// Says something to a simulator on a WebSocket of its own, reached as the gateway reaches it, and hears what
// comes until it has closed its side.
#include "adapters/messages/websocket_frames.hpp"
#include "upstream_visit.hpp"
#include "upstreams.hpp"

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/transport/simulator_talk.hpp>

#include <chrono>
#include <utility>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;

using adapters::WebSocketEvent;
using adapters::WebSocketSide;

constexpr auto talk_patience = std::chrono::seconds(2); // a browser waits for its end
constexpr std::size_t talk_read = std::size_t{16} << 10;
constexpr std::size_t max_talk_head = std::size_t{8} << 10;
constexpr std::size_t max_talk_heard = std::size_t{1} << 20;
// A fixed key will do: it only proves to browsers that no cache has answered.
constexpr std::string_view talk_handshake = "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
                                            "Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                                            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n";
constexpr std::string_view talk_accepted = "HTTP/1.1 101";

/// What has been said on one connection, and what is to be said next. Without sockets.
class SimulatorDialog
{
public:
    SimulatorDialog(std::vector<std::string> words, std::string last)
        : words_(std::move(words)), last_(std::move(last))
    {}

    /// Takes bytes of the simulator.   Returns: whether more may come.
    bool take(std::string_view bytes)
    {
        if (is_open_)
            return take_frames(bytes);
        head_.append(bytes);
        auto const end = head_.find("\r\n\r\n");
        if (end == std::string::npos)
            return head_.size() <= max_talk_head;
        if (!head_.starts_with(talk_accepted))
            return false;
        is_open_ = true;
        for (auto const& text : words_)
            append_text_frame(answer, text, WebSocketSide::client);
        return take_frames(std::string_view(head_).substr(end + 4));
    }

    std::string answer; ///< To be sent.
    std::vector<std::string> heard;

private:
    bool take_frames(std::string_view bytes)
    {
        while (!bytes.empty()) {
            auto event = reader_.next(bytes);
            if (event.kind == WebSocketEvent::Kind::ping)
                append_pong_frame(answer, event.payload, WebSocketSide::client);
            else if (event.kind == WebSocketEvent::Kind::message && !take_message(std::move(event.payload)))
                return false;
            else if (event.kind == WebSocketEvent::Kind::close || event.kind == WebSocketEvent::Kind::fault)
                return false;
        }
        return true;
    }

    bool take_message(std::string text)
    {
        size_ += text.size() + sizeof text; // empty ones take memory, too
        if (size_ > max_talk_heard)
            return false;
        if (!is_closing_ && text == last_) {
            is_closing_ = true;
            append_close_frame(answer, 1000, {}, WebSocketSide::client);
        }
        heard.push_back(std::move(text));
        return true;
    }

    std::vector<std::string> words_;
    std::string last_;
    std::string head_;
    adapters::WebSocketFrameReader reader_{max_talk_heard, WebSocketSide::server};
    std::size_t size_ = 0;
    bool is_open_ = false;
    bool is_closing_ = false;
};

class GatewaySimulatorTalk final : public SimulatorTalk
{
public:
    GatewaySimulatorTalk(asio::any_io_executor executor, Logger log)
        : executor_(std::move(executor)), upstreams_(executor_, params_, statistics_, std::move(log))
    {}

    asio::awaitable<std::vector<std::string>> talk(Upstream simulator, std::vector<std::string> words,
                                                   std::string last) override
    {
        adapters::UpstreamVisit visit(executor_, upstreams_, talk_patience);
        SimulatorDialog dialog(std::move(words), std::move(last));
        co_await lead(dialog, visit.socket(), simulator);
        co_return std::move(dialog.heard);
    }

private:
    static asio::awaitable<void> lead(SimulatorDialog& dialog, adapters::UpstreamSocket& socket,
                                      Upstream const& simulator)
    {
        auto const connected = co_await socket.connect(simulator);
        if (!connected)
            co_return;
        dialog.answer = talk_handshake;
        std::string bytes(talk_read, '\0');
        for (;;) {
            auto const answer = std::exchange(dialog.answer, {});
            if (!answer.empty()) {
                auto const written = co_await socket.write(answer);
                if (written)
                    co_return;
            }
            auto const [error, got] = co_await socket.read_some(bytes.data(), bytes.size());
            if (!dialog.take(std::string_view(bytes).substr(0, got)) || error)
                co_return;
        }
    }

    asio::any_io_executor executor_;
    HttpServerParams params_;
    HttpServerStatistics statistics_;
    adapters::Upstreams upstreams_;
};

} // namespace

std::unique_ptr<SimulatorTalk> make_simulator_talk(asio::any_io_executor executor, Logger log)
{
    return std::make_unique<GatewaySimulatorTalk>(std::move(executor), std::move(log));
}

} // namespace webots_cloud
