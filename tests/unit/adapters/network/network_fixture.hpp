// A server with a test endpoint on a free port of the loopback interface, and clients with blocking sockets.
#pragma once

#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <optional>
#include <string>
#include <sys/socket.h>
#include <sys/time.h>
#include <thread>

namespace webots_cloud {

inline constexpr auto patience = std::chrono::seconds(30); // a deadline for a broken server only

/// Answers every request with its path, except `/nothing` (an empty body), `/shared` (`shared`) and `/who`
/// (the client's address and quota key). WebSockets: `/echo` sends messages back, `/twice` two times
/// together,
/// `/who` first sends the same as above, `/flood` sends until the channel refuses, `/turns` counts messages.
class TestEndpoint final : public Endpoint
{
public:
    Answer respond(IncomingRequest const& request) override
    {
        if (forward && request.path.starts_with("/forward"))
            return *forward;
        if (request.upgrade)
            return AcceptWebSocket();
        if (request.path == "/who")
            return HttpResponse(200, "text/plain", name(request.client, request.quota_key));
        if (request.path == "/nothing")
            return HttpResponse(200, "text/plain", {});
        if (request.path == "/shared") {
            HttpResponse response(200, "text/plain", {});
            response.shared = shared;
            return response;
        }
        return HttpResponse(request.method == "POST" ? 405 : 200, "text/plain", std::string(request.path));
    }

    std::uint64_t max_body(IncomingRequest const& request) override
    {
        return request.path.starts_with("/body") ? 300'000 : 0;
    }

    /// Answers with the body; `/body/later` only when `held` has been cancelled.
    boost::asio::awaitable<HttpResponse> respond_to_body(IncomingRequest const& request) override
    {
        if (request.path == "/body/later") {
            boost::asio::steady_timer timer(co_await boost::asio::this_coro::executor,
                                            std::chrono::steady_clock::time_point::max());
            held = &timer;
            (void)co_await timer.async_wait(boost::asio::as_tuple(boost::asio::use_awaitable));
        }
        co_return HttpResponse(200, "text/plain", std::string(request.body));
    }

    void dress(HttpResponse& refusal, IncomingRequest const& request) override
    {
        if (request.header("Accept") == "text/html")
            refusal.body.insert(0, "dressed: ");
    }

    std::atomic<boost::asio::steady_timer*> held =
        nullptr; ///< Of `/body/later`: cancel it on the server's thread.

    boost::asio::awaitable<void> serve_websocket(ChannelInfo info, Channel& channel) override
    {
        if (info.path == "/flood")
            flood(channel);
        if (info.path == "/who")
            (void)channel.send(name(info.client, info.quota_key));
        if (info.path == "/turns")
            co_return co_await count_turns(channel);
        for (;;) {
            auto message = co_await channel.receive();
            if (!message) {
                last_failure = message.error();
                break;
            }
            if (info.path == "/twice")
                (void)channel.send_all(std::array{*message, *message});
            else
                (void)channel.send(std::move(*message));
        }
        ++ended;
    }

    std::size_t max_queued = 0; ///< Before it was refused.
    std::atomic<bool> flood_refused = false;
    std::atomic<int> ended = 0;                 ///< WebSocket conversations that are over.
    Failure last_failure;                       ///< Why the latest of them ended.
    std::atomic<int> messages = 0;              ///< On `/turns`.
    std::atomic<int> max_messages_per_turn = 0; ///< Of these, the most in one turn of the event loop.
    std::shared_ptr<SharedBody const> shared;
    std::optional<Forward> forward; ///< Of `/forward` and what begins so.

private:
    static std::string name(std::string_view client, std::string_view quota_key)
    {
        return "I am " + std::string(client) + ", counted by [" + std::string(quota_key) + "]\n";
    }

    /// Counts the messages that are received before the event loop runs other work.
    boost::asio::awaitable<void> count_turns(Channel& channel)
    {
        auto const executor = co_await boost::asio::this_coro::executor;
        for (;;) {
            auto const message = co_await channel.receive();
            if (!message)
                break;
            ++messages;
            if (++messages_this_turn_ == 1)
                boost::asio::post(executor, [this] { messages_this_turn_ = 0; });
            max_messages_per_turn = std::max(max_messages_per_turn.load(), messages_this_turn_);
        }
        ++ended;
    }

    int messages_this_turn_ = 0;

    void flood(Channel& channel)
    {
        // Far more than the kernel buffers for a connection.
        for (int i = 0; i < 10'000 && !flood_refused; ++i) {
            max_queued = std::max(max_queued, channel.queued());
            flood_refused = channel.send(std::string(60'000, 'x')) == Failure(errc::too_large);
        }
    }
};

inline bool eventually(std::function<bool()> const& condition)
{
    auto const end = std::chrono::steady_clock::now() + patience;
    while (!condition() && std::chrono::steady_clock::now() < end)
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return condition();
}

/// The server on a thread of its own.
class RunningServer
{
public:
    explicit RunningServer(HttpServerParams params = {})
    {
        params.network.listen_address = "127.0.0.1";
        server_ = make_http_server(context_.get_executor(), params, Logger());
        BOOST_REQUIRE(server_->listen().has_value());
        auto finished = [this](std::exception_ptr failure, result<> outcome) {
            ended_.set_value(failure ? result<>(Failure(errc::unavailable)) : outcome);
        };
        boost::asio::co_spawn(context_, server_->run(endpoint),
                              boost::asio::bind_cancellation_slot(cancel_.slot(), finished));
        thread_ = std::thread([this] { context_.run(); });
    }

    ~RunningServer()
    {
        if (thread_.joinable())
            stop();
    }

    /// Cancels it and waits for its end; false when it does not end in time.
    bool stop()
    {
        boost::asio::post(context_, [this] { cancel_.emit(boost::asio::cancellation_type::terminal); });
        auto future = ended_.get_future();
        bool const has_ended = future.wait_for(patience) == std::future_status::ready;
        if (!has_ended)
            context_.stop();
        thread_.join();
        return has_ended && future.get() == result<>(Failure(boost::asio::error::operation_aborted));
    }

    /// On the server's thread, soon.
    void post(std::function<void()> what) { boost::asio::post(context_, std::move(what)); }

    /// The same, and waits for it.
    void run(std::function<void()> const& what)
    {
        std::promise<void> done;
        boost::asio::post(context_, [&] {
            what();
            done.set_value();
        });
        done.get_future().get();
    }

    /// For its own thread.
    HttpServerStatistics statistics_now() const { return server_->statistics(); }

    HttpServerStatistics statistics()
    {
        std::promise<HttpServerStatistics> answer;
        boost::asio::post(context_, [&] { answer.set_value(server_->statistics()); });
        return answer.get_future().get();
    }

    bool eventually_counts(std::uint64_t HttpServerStatistics::*counter, std::uint64_t value)
    {
        return eventually([&] { return statistics().*counter == value; });
    }

    std::uint16_t port() const { return server_->port(); }

    TestEndpoint endpoint;

private:
    boost::asio::io_context context_{1};
    std::unique_ptr<HttpServer> server_;
    boost::asio::cancellation_signal cancel_;
    std::promise<result<>> ended_;
    std::thread thread_;
};

/// A connection with a blocking socket.
class BlockingConnection
{
public:
    void say(std::string_view bytes)
    {
        boost::system::error_code ignored; // the server may close while we send
        boost::asio::write(socket_, boost::asio::buffer(bytes), ignored);
    }

    /// Says that nothing more will come.
    void shut_down()
    {
        boost::system::error_code ignored;
        socket_.shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
    }

    int descriptor() { return socket_.native_handle(); }

    /// Reads up to and including `end`; less when the connection closes before.
    std::string read_to(std::string_view end)
    {
        std::string text;
        char byte = 0;
        while (!text.ends_with(end) && ::recv(socket_.native_handle(), &byte, 1, 0) == 1)
            text.push_back(byte);
        return text;
    }

    std::string read(std::size_t size)
    {
        std::string text(size, '\0');
        auto const got = ::recv(socket_.native_handle(), text.data(), size, MSG_WAITALL);
        text.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
        return text;
    }

    /// Reads everything until the server closes the connection.
    std::string read_all()
    {
        std::string text;
        std::array<char, 4096> part{};
        for (;;) {
            auto const size = ::recv(socket_.native_handle(), part.data(), part.size(), 0);
            if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
                BOOST_FAIL("the connection was not ended; before that came: " << text);
            if (size <= 0)
                return text;
            text.append(part.data(), static_cast<std::size_t>(size));
        }
    }

protected:
    BlockingConnection() : socket_(context_) {}

    void limit_patience()
    {
        timeval const limit{patience.count(), 0};
        ::setsockopt(socket_.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    }

    boost::asio::io_context context_;
    boost::asio::ip::tcp::socket socket_;
};

class Client : public BlockingConnection
{
public:
    /// `receive_buffer` limits what the kernel buffers for a client that does not read.
    explicit Client(RunningServer const& server, int receive_buffer = 0)
    {
        socket_.open(boost::asio::ip::tcp::v4());
        if (receive_buffer > 0)
            socket_.set_option(boost::asio::socket_base::receive_buffer_size(receive_buffer));
        socket_.connect({boost::asio::ip::make_address("127.0.0.1"), server.port()});
        limit_patience();
    }

    /// Asks for a WebSocket. `fields`: more header fields, each with its line end.
    void ask_upgrade(std::string const& path, std::string const& fields)
    {
        say("GET " + path + " HTTP/1.1\r\nHost: h\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n" + fields +
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n");
    }

    /// The same, and reads the answer's headers.
    void upgrade(std::string const& path, std::string const& fields = {})
    {
        ask_upgrade(path, fields);
        BOOST_TEST_REQUIRE(read_to("\r\n\r\n").starts_with("HTTP/1.1 101 "));
    }
};

} // namespace webots_cloud
