// Requests to other servers, mostly polls. Connections are kept for the next request, and every byte of an
// answer counts against a limit, since any machine on the list may be hostile or broken.
#include "adapters/messages/parse_message.hpp"
#include "client_stream.hpp"
#include "core/text.hpp"
#include "server_connection.hpp"

#include <webots_cloud/adapters/http_client.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/read_size.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include <iterator>
#include <optional>
#include <sys/socket.h>
#include <unordered_map>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using adapters::ServerTarget;
using asio::ip::tcp;
using core::concat;

// Connections kept for the next request: as many servers as one session server may poll.
constexpr std::size_t max_idle = 16 * 1024;

constexpr std::size_t usual_request = 256; // bytes, without its body

// Of an answer, before the parser has taken them: headers, trailers, and the line before a chunk, which must
// be there as a whole. The parser looks through all of it again whenever more has come.
constexpr std::size_t max_unparsed = 16 * 1024;

// Of an answer altogether: what surrounds the chunks of a body may be as long as the body, and headers as
// trailers as long as can be parsed.
constexpr std::size_t max_answer(std::size_t body_limit) noexcept
{
    return 2 * (body_limit + max_unparsed);
}

// What a certificate says is looked at anew that often: one that has expired is noticed.
constexpr auto max_age_of_tls = std::chrono::minutes(10);

/// A connection to one server, plain or encrypted.
class Connection
{
public:
    /// Plain without `tls`.
    Connection(asio::any_io_executor const& executor, asio::ssl::context* tls)
        : stream_(executor, tls),
          must_end_at_(tls ? std::chrono::steady_clock::now() + max_age_of_tls : TimePoint::max())
    {}

    /// As `ServerDirectory::open_connection`.
    asio::awaitable<result<>> open(adapters::ServerDirectory& servers, ServerTarget const& target,
                                   std::vector<tcp::endpoint> addresses)
    {
        return servers.open_connection(stream_.lowest(), stream_.encrypted(), target, std::move(addresses));
    }
    asio::awaitable<result<HttpResponse>> exchange(std::string request, std::size_t body_limit);

    void expires_at(TimePoint when) { stream_.lowest().expires_at(when); }
    bool is_reusable() const noexcept
    {
        return reusable_ &&
               (must_end_at_ == TimePoint::max() || std::chrono::steady_clock::now() < must_end_at_);
    }
    /// Some byte of an answer has come: the request must not be repeated.
    bool has_answered() const noexcept { return answered_; }

private:
    using Parser = http::response_parser<http::string_body>;

    adapters::ClientStream stream_;
    beast::flat_buffer buffer_{max_unparsed};
    TimePoint must_end_at_;
    bool reusable_ = false;
    bool answered_ = false;
};

/// A request fits into the buffer of its socket: to wait for that, with a deadline, would cost a quarter of a
/// poll. Returns how many bytes went out; what is wrong, if anything, shows when the others follow.
std::size_t send_at_once(tcp::socket& socket, std::string_view bytes)
{
    auto const sent = ::send(socket.native_handle(), bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    return sent < 0 ? 0 : static_cast<std::size_t>(sent);
}

HttpResponse to_response(http::response<http::string_body> message)
{
    HttpResponse response;
    response.status = static_cast<int>(message.result_int());
    response.headers.reserve(static_cast<std::size_t>(std::distance(message.begin(), message.end())));
    for (auto const& field : message)
        response.headers.emplace_back(std::string(field.name_string()), std::string(field.value()));
    response.body = std::move(message.body());
    return response;
}

Failure explain(beast::error_code error)
{
    if (error == beast::error::timeout)
        return Failure(errc::timed_out);
    if (error == asio::error::operation_aborted)
        return Failure(error);
    if (error == http::error::body_limit || error == http::error::header_limit ||
        error == http::error::buffer_overflow)
        return Failure(errc::too_large, "the answer is too large");
    if (error.category() == http::make_error_code(http::error::end_of_stream).category())
        return Failure(errc::protocol_error, concat("no HTTP answer: ", error.message()));
    return Failure(errc::unreachable, error.message());
}

asio::awaitable<result<HttpResponse>> Connection::exchange(std::string request, std::size_t body_limit)
{
    reusable_ = false;
    answered_ = false;
    auto rest = asio::buffer(request);
    if (!stream_.encrypted())
        rest += send_at_once(stream_.lowest().socket(), request);
    if (rest.size() > 0) {
        auto const [error, written] =
            co_await asio::async_write(stream_, rest, asio::as_tuple(asio::use_awaitable));
        if (error)
            co_return explain(error);
    }
    Parser parser;
    parser.body_limit(body_limit);
    parser.eager(true);
    std::size_t received = 0;
    while (!parser.is_done()) {
        // Not through http::async_read: its limits know nothing of what surrounds the chunks.
        auto const room = buffer_.prepare(beast::read_size(buffer_, max_unparsed));
        if (room.size() == 0)
            co_return explain(http::error::buffer_overflow);
        auto const [read_error, read] =
            co_await stream_.async_read_some(room, asio::as_tuple(asio::use_awaitable));
        buffer_.commit(read);
        received += read;
        auto const parse_error =
            read_error ? adapters::parse_end(parser, read_error) : adapters::parse_received(parser, buffer_);
        answered_ = parser.got_some();
        if (parse_error)
            co_return explain(parse_error);
        if (received > max_answer(body_limit))
            co_return explain(http::error::body_limit);
    }
    // Bytes that follow the answer belong to none that we have asked for, and would be taken for the next
    // one.
    reusable_ = parser.keep_alive() && buffer_.size() == 0;
    co_return to_response(parser.release());
}

/// An open connection that waits for the next request to where it leads.
struct IdleConnection
{
    IdleConnection() = default;

    ServerTarget target;
    std::unique_ptr<Connection> connection;
};

/// Sends a request on the connection that was kept for its URL, or on a new one.
class BeastClient final : public HttpClient
{
public:
    BeastClient(asio::any_io_executor executor, HttpClientConfig config, Logger log)
        : executor_(std::move(executor)), servers_(executor_, std::move(config), std::move(log))
    {}

    asio::awaitable<result<HttpResponse>> send(HttpRequest request) override;

private:
    asio::awaitable<result<HttpResponse>> send_anew(HttpRequest request, TimePoint deadline);
    result<std::unique_ptr<Connection>> make_connection(bool tls);
    bool may_keep(Connection& connection) const;

    asio::any_io_executor executor_;
    adapters::ServerDirectory servers_;
    std::unordered_map<std::string, IdleConnection> idle_; ///< By `key_of` a request.
};

/// Where it leads: the whole URL, so that a poll need not take it apart, and the address, if it has one.
std::string key_of(HttpRequest const& request)
{
    return request.address.empty() ? request.url : concat(request.address, " ", request.url);
}

// Not through Beast's serializer, which takes as long as all the rest of a poll.
std::string to_text(HttpRequest const& request, ServerTarget const& target)
{
    bool const is_v6 = target.host.find(':') != std::string::npos;
    std::string text;
    text.reserve(usual_request + request.body.size());
    text.append(request.method)
        .append(" ")
        .append(target.path)
        .append(" HTTP/1.1\r\nHost: ")
        .append(is_v6 ? "[" : "")
        .append(target.host)
        .append(is_v6 ? "]" : "");
    if (!target.has_usual_port())
        text.append(":").append(std::to_string(target.port));
    text.append("\r\nUser-Agent: webots_cloud\r\n");
    for (auto const& [name, value] : request.headers)
        text.append(name).append(": ").append(value).append("\r\n");
    if (!request.body.empty() || request.method != "GET")
        text.append("Content-Length: ").append(std::to_string(request.body.size())).append("\r\n");
    return text.append("\r\n").append(request.body);
}

asio::awaitable<result<HttpResponse>> BeastClient::send(HttpRequest request)
{
    auto const deadline = std::chrono::steady_clock::now() + request.timeout;

    // The peer may close a kept connection just when we use it: then, and only then, the request goes out
    // once more.
    if (auto kept = idle_.extract(key_of(request))) {
        auto& connection = *kept.mapped().connection;
        connection.expires_at(deadline);
        auto response =
            co_await connection.exchange(to_text(request, kept.mapped().target), request.body_limit);
        bool const is_stale = !response && !connection.has_answered() &&
                              response.error().code() != asio::error::operation_aborted &&
                              std::chrono::steady_clock::now() < deadline;
        if (response && may_keep(connection))
            idle_.insert(std::move(kept));
        if (!is_stale)
            co_return response;
    }
    co_return co_await send_anew(std::move(request), deadline);
}

/// A coroutine of its own, so that polls on kept connections do not carry its frame.
asio::awaitable<result<HttpResponse>> BeastClient::send_anew(HttpRequest request, TimePoint deadline)
{
    auto target = adapters::parse_http_target(request.url);
    if (!target)
        co_return target.error();
    target->address = request.address;
    target->elsewhere = request.elsewhere;
    auto addresses = co_await servers_.resolve(*target, deadline);
    if (!addresses)
        co_return addresses.error();
    IdleConnection fresh;
    auto made = make_connection(target->tls);
    if (!made)
        co_return made.error();
    fresh.connection = std::move(*made);
    auto& connection = *fresh.connection;
    connection.expires_at(deadline);
    auto const opened = co_await connection.open(servers_, *target, std::move(*addresses));
    if (!opened)
        co_return opened.error();
    auto response = co_await connection.exchange(to_text(request, *target), request.body_limit);
    fresh.target = std::move(*target);
    if (response && may_keep(connection))
        idle_.insert_or_assign(key_of(request), std::move(fresh));
    co_return response;
}

result<std::unique_ptr<Connection>> BeastClient::make_connection(bool tls)
{
    if (!tls)
        return std::make_unique<Connection>(executor_, nullptr);
    auto context = servers_.tls();
    if (!context)
        return context.error();
    return std::make_unique<Connection>(executor_, &*context);
}

/// Takes the deadline off a connection that may be used again.
bool BeastClient::may_keep(Connection& connection) const
{
    if (!connection.is_reusable() || idle_.size() >= max_idle)
        return false;
    connection.expires_at(TimePoint::max());
    return true;
}

} // namespace

std::unique_ptr<HttpClient> make_http_client(asio::any_io_executor executor, HttpClientConfig config,
                                             Logger log)
{
    return std::make_unique<BeastClient>(std::move(executor), std::move(config), std::move(log));
}

} // namespace webots_cloud
