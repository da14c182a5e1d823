// Accepts connections, and shares what there is of descriptors and memory among clients: when there is no
// more room, the one goes that can be spared most easily. Handshakes take turns by client
// (core/access/fair_queue). Nothing here reads HTTP; that is http_connection.cpp.
#include "adapters/network/acceptor.hpp"
#include "adapters/network/address_space.hpp"
#include "async/cancellation.hpp"
#include "async/task_count.hpp"
#include "core/access/accept_failure.hpp"
#include "core/text.hpp"
#include "freed_memory.hpp"
#include "http_connection.hpp"
#include "websocket_channel.hpp"

#include <webots_cloud/adapters/http_server.hpp>

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <list>
#include <optional>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
using adapters::ConnectionLimit;
using adapters::HttpConnection;
using adapters::HttpConnectionContext;
using adapters::Peer;
using adapters::WebSocketChannel;
using asio::ip::tcp;
using core::concat;

// Deadlines are seconds, and are noticed this late at most.
constexpr auto sweep_interval = std::chrono::seconds(1);
constexpr int accepted_at_once = 16; // before others have their turn
constexpr auto accept_pause = std::chrono::milliseconds(20);
// Between two lines about a lack of room: thousands of connections a second may be refused.
constexpr auto complaint_interval = std::chrono::minutes(1);

constexpr std::string_view busy_answer =
    "HTTP/1.1 503 Service Unavailable\r\nServer: webots_cloud\r\n"
    "Content-Type: text/html; charset=UTF-8\r\nRetry-After: 5\r\nContent-Length: 53\r\n"
    "Connection: close\r\n\r\n"
    "Too many connections. Please try again in a moment.\r\n";

asio::ip::address address_of(tcp::socket const& socket)
{
    boost::system::error_code gone;
    auto const address = socket.remote_endpoint(gone).address();
    if (address.is_v6() && address.to_v6().is_v4_mapped())
        return asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6());
    return address;
}

/// A WebSocket and its right to exist.
struct Conversation
{
    Conversation(HttpConnection& connection, HttpConnectionContext const& context)
        : ticket(connection.take_ticket()),
          channel(connection.take_stream(), context.params, context.statistics)
    {}

    ConnectionLimit::Ticket ticket;
    WebSocketChannel channel;
};

/// A port of the network with its connections, each in the list of its stage, and what they share.
class NetworkServer final : public HttpServer
{
public:
    NetworkServer(asio::any_io_executor executor, HttpServerParams params, Logger log)
        : executor_(std::move(executor)), params_(std::move(params)), log_(std::move(log)),
          proxies_(params_.network.trusted_proxies),
          limit_(static_cast<std::size_t>(params_.network.connections_per_address), statistics_, log_),
          handshakes_(executor_, memory_), tunnels_(executor_, params_, statistics_),
          upstreams_(executor_, params_, statistics_, log_),
          context_{params_,     nullptr,  log_,       statistics_,  proxies_, limit_,
                   handshakes_, tunnels_, upstreams_, forwardings_, bodies_,  [this] { return has_room(1); }},
          acceptor_(executor_), sweeper_(executor_), tasks_(executor_)
    {}

    result<> listen() override;
    asio::awaitable<result<>> run(Endpoint& endpoint) override;
    std::uint16_t port() const override { return acceptor_.port(); }
    HttpServerStatistics statistics() const override;

private:
    using Connections = std::list<HttpConnection>; // oldest first
    using Conversations = std::list<Conversation>;

    asio::awaitable<result<>> accept();
    asio::awaitable<void> serve(Connections::iterator connection);
    asio::awaitable<void> serve_websocket(Connections::iterator connection,
                                          Conversations::iterator conversation);
    asio::awaitable<void> stop();
    asio::awaitable<void> recover(boost::system::error_code failed);
    void admit(tcp::socket socket);
    Conversations::iterator begin_conversation(HttpConnection& connection);
    void complain(std::string_view sentence);
    bool make_room();
    bool cut_closing();
    void sweep();
    /// Whether there is one for one more connection, if need be at the expense of another; `counted` are in
    /// `open()` already.
    bool has_room(std::size_t counted = 0)
    {
        return memory_.has_room() && (open() < max_connections_ + counted || make_room());
    }
    /// Descriptors in use.
    std::size_t open() const noexcept
    {
        return silent_.size() + active_.size() + conversations_.size() + forwardings_ +
               tunnels_.descriptors();
    }

    asio::any_io_executor executor_;
    HttpServerParams params_;
    Logger log_;
    HttpServerStatistics statistics_;
    core::IpNetworks proxies_;
    ConnectionLimit limit_;
    adapters::AddressSpace memory_;
    adapters::Handshakes handshakes_;
    /// Requests on their way to other servers, each with a connection of its own.
    std::size_t forwardings_ = 0;
    adapters::BodyMemory bodies_{params_.body_bytes};
    adapters::Tunnels tunnels_;
    adapters::Upstreams upstreams_;
    HttpConnectionContext context_;
    adapters::Acceptor acceptor_;
    std::optional<adapters::TlsCertificate> certificate_;
    asio::steady_timer sweeper_;
    Connections silent_; ///< Without a complete request so far: what makes room when descriptors run out.
    Connections active_;
    Conversations conversations_;
    adapters::FreedMemory freed_;
    std::size_t max_connections_ = 0;
    TimePoint next_complaint_ = TimePoint::min();
    async::TaskCount tasks_;
};

result<> NetworkServer::listen()
{
    if (acceptor_.is_open())
        return {};
    if (!proxies_.malformed().empty())
        return Failure(errc::invalid_config,
                       concat("A trusted proxy is neither an address nor a network: ", proxies_.malformed()));
    if (!params_.network.ssl_certificate.empty()) {
        certificate_.emplace(params_.network.ssl_certificate, params_.network.ssl_key, log_);
        if (auto const loaded = certificate_->load(); !loaded)
            return loaded;
    }
    max_connections_ = std::min(
        params_.max_connections,
        adapters::affordable_connections(params_.spare_descriptors +
                                         (params_.keeps_watches ? adapters::WatchReserve::descriptors : 0)));
    limit_.leave_room(max_connections_);
    auto listening = acceptor_.listen(params_.network.listen_address, params_.port);
    if (listening && params_.keeps_watches)
        acceptor_.keep_watches();
    return listening;
}

HttpServerStatistics NetworkServer::statistics() const
{
    auto statistics = statistics_;
    statistics.connections = silent_.size() + active_.size() + conversations_.size() + tunnels_.open_ended();
    statistics.websockets = conversations_.size();
    statistics.tunnels = tunnels_.open_ended();
    if (certificate_)
        statistics.certificate_expires = certificate_->expires();
    return statistics;
}

asio::awaitable<result<>> NetworkServer::run(Endpoint& endpoint)
{
    context_.endpoint = &endpoint;
    if (auto const listening = listen(); !listening)
        co_return listening.error();
    co_await asio::this_coro::throw_if_cancelled(false);
    sweep();
    auto const ended = co_await accept();
    // Only accepting can be cancelled. What was begun is ended in order.
    co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
    co_await stop();
    co_return ended;
}

asio::awaitable<result<>> NetworkServer::accept()
{
    for (;;) {
        auto [error] = co_await acceptor_.wait();
        for (int i = 0; !error && i < accepted_at_once; ++i) {
            tcp::socket socket(executor_);
            error = acceptor_.take(socket);
            if (!error)
                admit(std::move(socket));
        }
        if (error && error != asio::error::would_block && error != asio::error::operation_aborted)
            co_await recover(error);
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled || error == asio::error::operation_aborted)
            co_return Failure(asio::error::operation_aborted);
    }
}

/// After an accept that failed: the peer has gone already, or descriptors, watches or memory have run out.
asio::awaitable<void> NetworkServer::recover(boost::system::error_code failed)
{
    if (failed == asio::error::connection_aborted || failed == asio::error::interrupted ||
        failed == boost::system::errc::protocol_error)
        co_return;
    complain(core::describe_accept_failure("a connection", failed.value()));
    bool const is_lost = failed == boost::system::errc::no_space_on_device;
    if (is_lost)
        ++statistics_.refused_no_room;
    if (make_room())
        co_return;
    if (!is_lost && acceptor_.turn_away())
        ++statistics_.refused_no_room;
    // Nothing can be freed at once: without a pause this would spin.
    asio::steady_timer timer(executor_, accept_pause);
    (void)co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
}

void NetworkServer::complain(std::string_view sentence)
{
    auto const now = std::chrono::steady_clock::now();
    if (now < next_complaint_)
        return;
    next_complaint_ = now + complaint_interval;
    log_.error(sentence);
}

void NetworkServer::admit(tcp::socket socket)
{
    ++statistics_.accepted;
    Peer peer(address_of(socket), proxies_);
    ConnectionLimit::Ticket ticket;
    bool const is_admitted = limit_.admit(peer.quota_key, ticket);
    // The client's own limit first: nobody is cut for the sake of one who is refused anyway.
    bool const is_welcome = is_admitted && has_room();
    if (is_admitted && !is_welcome) {
        ++statistics_.refused_no_room;
        complain(memory_.has_room()
                     ? "Connections are refused: there are as many as the limit of open files allows"
                     : "Connections are refused: there is little memory left, see \"ulimit -v\"");
    }
    if (!is_welcome) {
        adapters::NetworkStream stream(std::move(socket), nullptr);
        boost::system::error_code ignored;
        // A client that expects TLS would take a sentence for garbage.
        if (!certificate_)
            stream.try_write(busy_answer, ignored);
        stream.shut_down();
        return;
    }
    adapters::NetworkStream stream(std::move(socket), certificate_ ? certificate_->context() : nullptr);
    auto const connection =
        silent_.emplace(silent_.end(), std::move(stream), std::move(peer), std::move(ticket), context_);
    tasks_.spawn(serve(connection));
}

asio::awaitable<void> NetworkServer::serve(Connections::iterator connection)
{
    bool const has_spoken = co_await connection->await_first_request();
    if (!has_spoken) {
        silent_.erase(connection);
        freed_.note(open());
        co_return;
    }
    // From here on it is not among the first to make room for others.
    active_.splice(active_.end(), silent_, connection);
    auto const outcome = co_await connection->answer_requests();
    if (outcome == HttpConnection::Outcome::tunnel)
        tunnels_.open(connection->take_tunnel());
    if (outcome != HttpConnection::Outcome::websocket) {
        active_.erase(connection);
        freed_.note(open());
        co_return;
    }
    auto const conversation = begin_conversation(*connection);
    co_await serve_websocket(connection, conversation);
    co_await conversation->channel.finish();
    conversations_.erase(conversation);
    freed_.note(open());
}

NetworkServer::Conversations::iterator NetworkServer::begin_conversation(HttpConnection& connection)
{
    auto const conversation = conversations_.emplace(conversations_.end(), connection, context_);
    conversation->channel.start(connection.rest());
    if (!acceptor_.is_open())
        conversation->channel.close(1001, "the server is stopping");
    return conversation;
}

/// Nothing that belongs to HTTP lives on with it, and no frame of its own: this is no coroutine.
asio::awaitable<void> NetworkServer::serve_websocket(Connections::iterator connection,
                                                     Conversations::iterator conversation)
{
    auto info = connection->channel_info();
    active_.erase(connection);
    return context_.endpoint->serve_websocket(std::move(info), conversation->channel);
}

/// Closes the oldest connection that has said nothing yet, or else one that waits between two requests, or
/// else for the answer to our close.
bool NetworkServer::make_room()
{
    auto victim =
        std::find_if(silent_.begin(), silent_.end(), [](HttpConnection const& c) { return !c.is_cut(); });
    if (victim == silent_.end()) {
        victim = std::find_if(active_.begin(), active_.end(),
                              [](HttpConnection const& c) { return c.is_idle() && !c.is_cut(); });
        if (victim == active_.end())
            return cut_closing();
    }
    ++statistics_.made_room;
    victim->cut();
    return true;
}

/// Gives up on the oldest WebSocket that we have closed and whose browser does not answer that.
bool NetworkServer::cut_closing()
{
    auto const victim = std::find_if(conversations_.begin(), conversations_.end(),
                                     [](Conversation const& c) { return c.channel.awaits_farewell(); });
    if (victim == conversations_.end())
        return false;
    ++statistics_.made_room;
    victim->channel.cut();
    return true;
}

void NetworkServer::sweep()
{
    auto const now = std::chrono::steady_clock::now();
    for (auto& connection : silent_)
        connection.check(now);
    for (auto& connection : active_)
        connection.check(now);
    for (auto& conversation : conversations_)
        conversation.channel.check(now);
    tunnels_.check(now);
    if (certificate_)
        certificate_->renew();
    acceptor_.renew_watches();
    sweeper_.expires_after(sweep_interval);
    sweeper_.async_wait([this](boost::system::error_code error) {
        if (!error)
            sweep();
    });
}

asio::awaitable<void> NetworkServer::stop()
{
    acceptor_.close();
    sweeper_.cancel();
    // Those that wait for a request end at once; the others have until `stop_timeout` to finish their
    // answers.
    for (auto* const connections : {&silent_, &active_})
        for (auto& connection : *connections)
            connection.stop();
    context_.endpoint->stopping();
    for (auto& conversation : conversations_)
        conversation.channel.close(1001, "the server is stopping");
    asio::steady_timer patience(executor_, params_.stop_timeout);
    patience.async_wait([this](boost::system::error_code error) {
        if (error)
            return;
        for (auto* const connections : {&silent_, &active_})
            for (auto& connection : *connections)
                connection.cut();
        for (auto& conversation : conversations_)
            conversation.channel.cut();
        tunnels_.cut_all();
    });
    co_await tasks_.join();
    co_await tunnels_.join();
    patience.cancel();
}

} // namespace

std::unique_ptr<HttpServer> make_http_server(asio::any_io_executor executor, HttpServerParams params,
                                             Logger log)
{
    return std::make_unique<NetworkServer>(std::move(executor), std::move(params), std::move(log));
}

} // namespace webots_cloud
