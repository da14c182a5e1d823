#include "upstream_socket.hpp"

#include "core/text.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/write.hpp>

#include <cerrno>
#include <cstring>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using asio::ip::tcp;
using core::concat;

namespace {

constexpr auto as_result = asio::as_tuple(asio::deferred);
constexpr auto retry_after = std::chrono::milliseconds(10);

Failure unreachable(boost::system::error_code error)
{
    bool const is_ours = error == asio::error::no_descriptors ||
                         error == boost::system::errc::too_many_files_open_in_system ||
                         error == asio::error::no_buffer_space || error == asio::error::no_memory;
    return Failure(is_ours ? errc::unavailable : errc::unreachable, error.message());
}

boost::system::error_code last_error()
{
    return {errno, boost::system::system_category()};
}

/// The descriptor that comes with a message; negative when none does.
int take_descriptor(int broker)
{
    char byte = 0;
    iovec part{&byte, 1};
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))];
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    auto const size = ::recvmsg(broker, &message, MSG_CMSG_CLOEXEC);
    auto const* const header = size > 0 ? CMSG_FIRSTHDR(&message) : nullptr;
    if (!header || header->cmsg_level != SOL_SOCKET || header->cmsg_type != SCM_RIGHTS)
        return -1;
    int taken = -1;
    auto const count = (header->cmsg_len - CMSG_LEN(0)) / sizeof(int); // the padding has room for a second
    for (std::size_t i = 0; i < count; ++i) {
        int descriptor = -1;
        std::memcpy(&descriptor, CMSG_DATA(header) + i * sizeof(int), sizeof descriptor);
        if (i == 0)
            taken = descriptor;
        else
            ::close(descriptor);
    }
    return taken;
}

bool is_stream_socket(int descriptor)
{
    int type = 0;
    socklen_t size = sizeof type;
    return ::getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_STREAM;
}

} // namespace

UpstreamSocket::UpstreamSocket(asio::any_io_executor const& executor)
    : socket_(executor), broker_(executor), retry_(executor)
{}

asio::awaitable<result<>> UpstreamSocket::connect(Upstream const& upstream)
{
    if (!upstream.broker.empty()) {
        auto through = co_await connect_through(upstream.broker.string());
        if (!through)
            co_return through;
    } else {
        boost::system::error_code error;
        auto const address = asio::ip::make_address(upstream.host, error);
        if (error)
            co_return Failure(errc::unreachable, concat("\"", upstream.host, "\" is no numeric address"));
        auto const [failed] =
            co_await socket_.async_connect(tcp::endpoint(address, upstream.port), as_result);
        if (failed)
            co_return unreachable(failed);
    }
    if (is_closed_) {
        close();
        co_return Failure(errc::closed);
    }
    boost::system::error_code ignored;
    socket_.native_non_blocking(true, ignored);
    socket_.set_option(tcp::no_delay(true), ignored);
    co_return result<>();
}

asio::awaitable<result<>> UpstreamSocket::connect_through(std::string broker)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    if (broker.size() >= sizeof address.sun_path)
        co_return Failure(errc::unreachable, concat("the path of the socket is too long: ", broker));
    std::memcpy(address.sun_path, broker.c_str(), broker.size() + 1);
    boost::system::error_code error;
    broker_.open(asio::local::stream_protocol(), error);
    if (!error)
        broker_.native_non_blocking(true, error);
    if (error)
        co_return unreachable(error);
    // The queue of those who wait to be accepted may be full: then the kernel has nothing to wait for.
    while (::connect(broker_.native_handle(), reinterpret_cast<sockaddr const*>(&address), sizeof address) !=
           0) {
        error = last_error();
        if (error != asio::error::would_block)
            co_return unreachable(error);
        retry_.expires_after(retry_after);
        (void)co_await retry_.async_wait(as_result);
        if (is_closed_)
            co_return Failure(errc::closed);
    }
    auto const [waited] =
        co_await broker_.async_wait(asio::local::stream_protocol::socket::wait_read, as_result);
    if (waited || is_closed_)
        co_return Failure(errc::closed);
    co_return take_socket();
}

result<> UpstreamSocket::take_socket()
{
    int const descriptor = take_descriptor(broker_.native_handle());
    boost::system::error_code error;
    broker_.close(error);
    if (descriptor < 0)
        return Failure(errc::unreachable, "the broker has no connection for us");
    if (is_stream_socket(descriptor))
        socket_.assign(tcp::v4(), descriptor, error);
    else
        error = asio::error::not_socket;
    if (!error)
        return {};
    ::close(descriptor);
    return unreachable(error);
}

asio::awaitable<boost::system::error_code> UpstreamSocket::write(std::string_view bytes)
{
    auto const [error, size] =
        co_await asio::async_write(socket_, asio::buffer(bytes.data(), bytes.size()), as_result);
    co_return error;
}

asio::awaitable<std::pair<boost::system::error_code, std::size_t>> UpstreamSocket::read_some(char* to,
                                                                                             std::size_t size)
{
    auto const [error, read] = co_await socket_.async_read_some(asio::buffer(to, size), as_result);
    co_return std::pair(error, read);
}

void UpstreamSocket::close() noexcept
{
    is_closed_ = true;
    boost::system::error_code ignored;
    socket_.close(ignored);
    broker_.close(ignored);
    retry_.cancel();
}

int UpstreamSocket::release() noexcept
{
    if (!socket_.is_open())
        return -1;
    boost::system::error_code error;
    int const descriptor = socket_.release(error);
    return error ? -1 : descriptor;
}

} // namespace webots_cloud::adapters
