#include "client_stream.hpp"

#include <boost/beast/core/stream_traits.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>

namespace webots_cloud::adapters {

ClientStream::ClientStream(executor_type const& executor, boost::asio::ssl::context* tls)
{
    if (tls)
        stream_.emplace<EncryptedStream>(executor, *tls);
    else
        stream_.emplace<PlainStream>(executor);
}

PlainStream& ClientStream::lowest() noexcept
{
    if (auto* const plain = std::get_if<PlainStream>(&stream_))
        return *plain;
    return boost::beast::get_lowest_layer(*encrypted());
}

void ClientStream::read(boost::asio::mutable_buffer buffer, Waiting waiting)
{
    if (auto* const stream = encrypted())
        stream->async_read_some(buffer, std::move(waiting));
    else
        lowest().async_read_some(buffer, std::move(waiting));
}

void ClientStream::write(Gathered const& buffers, Waiting waiting)
{
    if (auto* const stream = encrypted())
        stream->async_write_some(buffers, std::move(waiting));
    else
        lowest().async_write_some(buffers, std::move(waiting));
}

void ClientStream::tear_down(boost::beast::role_type role, Waiting waiting)
{
    using boost::beast::websocket::async_teardown;
    if (auto* const stream = encrypted())
        async_teardown(role, *stream, std::move(waiting));
    else
        async_teardown(role, lowest(), std::move(waiting));
}

} // namespace webots_cloud::adapters
