// Asks a server of ours on this machine, which another program has started, in one connection of its own.
#include "own_server_probe.hpp"

#include "adapters/host/epoll_watches.hpp"
#include "adapters/messages/parse_message.hpp"
#include "client_stream.hpp"
#include "core/text.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

namespace webots_cloud::adapters {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using asio::ip::tcp;
using core::concat;
using Parser = http::response_parser<http::string_body>;

constexpr std::size_t max_own_answer = std::size_t{1} << 20;
constexpr std::size_t own_answer_piece = 16 * 1024;

Failure own_server_failure(beast::error_code error)
{
    return Failure(error == beast::error::timeout ? errc::timed_out : errc::unreachable, error.message());
}

/// Reads until `parser` has all of the answer.
asio::awaitable<beast::error_code> read_own_answer(ClientStream& stream, Parser& parser)
{
    beast::flat_buffer buffer(own_answer_piece);
    beast::error_code failed;
    while (!failed && !parser.is_done()) {
        auto const left = own_answer_piece - buffer.size();
        if (left == 0)
            co_return http::error::buffer_overflow;
        auto const room = buffer.prepare(left);
        auto const [error, size] = co_await stream.async_read_some(room, asio::as_tuple(asio::use_awaitable));
        buffer.commit(size);
        failed = error ? parse_end(parser, error) : parse_received(parser, buffer);
    }
    co_return failed;
}

asio::awaitable<result<HttpResponse>> ask_in_time(tcp::endpoint where, asio::ssl::context* tls,
                                                  std::string request, Duration limit)
{
    ClientStream stream(co_await asio::this_coro::executor, tls);
    stream.lowest().expires_after(limit);
    auto const [unreachable] =
        co_await stream.lowest().async_connect(where, asio::as_tuple(asio::use_awaitable));
    if (unreachable)
        co_return own_server_failure(unreachable);
    if (auto* const encrypted = stream.encrypted()) {
        auto const [refused] = co_await encrypted->async_handshake(asio::ssl::stream_base::client,
                                                                   asio::as_tuple(asio::use_awaitable));
        if (refused)
            co_return own_server_failure(refused);
    }
    auto const [unsent, sent] =
        co_await asio::async_write(stream, asio::buffer(request), asio::as_tuple(asio::use_awaitable));
    if (unsent)
        co_return own_server_failure(unsent);
    Parser parser;
    parser.eager(true);
    parser.body_limit(max_own_answer);
    auto const unread = co_await read_own_answer(stream, parser);
    if (unread == beast::error::timeout)
        co_return Failure(errc::timed_out);
    if (unread)
        co_return Failure(errc::protocol_error, unread.message());
    auto message = parser.release();
    HttpResponse response;
    response.status = static_cast<int>(message.result_int());
    response.content_type = std::string(message[http::field::content_type]);
    response.body = std::move(message.body());
    co_return response;
}

} // namespace

result<HttpResponse> ask_own_server(OwnServer const& server, std::string const& target, Duration limit)
{
    boost::system::error_code failed;
    auto const address = asio::ip::make_address(server.address, failed);
    if (failed)
        return Failure(errc::unreachable, concat(server.address, ": ", failed.message()));
    if (auto const found = find_watches(); !found)
        return found.error();
    asio::io_context context;
    // It verifies nothing: nobody is between us and this machine.
    asio::ssl::context tls(asio::ssl::context::tls_client);
    auto request = concat("GET ", target, " HTTP/1.1\r\nHost: localhost:", std::to_string(server.port),
                          "\r\nAccept: application/json\r\nConnection: close\r\n\r\n");
    result<HttpResponse> outcome = Failure(errc::timed_out);
    auto const take = [&outcome](std::exception_ptr failure, result<HttpResponse> answer) {
        if (failure)
            std::rethrow_exception(failure);
        outcome = std::move(answer);
    };
    asio::co_spawn(
        context, ask_in_time({address, server.port}, server.tls ? &tls : nullptr, std::move(request), limit),
        take);
    context.run();
    return outcome;
}

} // namespace webots_cloud::adapters
