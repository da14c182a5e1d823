// Three ways to the server behind a tunnel: TCP, TLS, or a socket that the guard hands out from a
// simulation's network (broker). What comes from there is checked to be such a socket.
#include "upstream_socket.hpp"

#include "adapters/names/machine_addresses.hpp"
#include "core/text.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/ip/address.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <cerrno>
#include <cstring>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>
#include <utility>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using asio::ip::tcp;
using core::concat;

namespace {

constexpr auto without_throwing = asio::as_tuple(asio::deferred);
constexpr auto retry_after = std::chrono::milliseconds(10); // where the broker's queue is full

boost::system::error_code socket_error()
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

UpstreamSocket::UpstreamSocket(asio::any_io_executor const& executor, Upstreams& upstreams)
    : upstreams_(upstreams), stream_(tcp::socket(executor), nullptr), broker_(executor), retry_(executor)
{}

Failure UpstreamSocket::unreachable(boost::system::error_code error)
{
    bool const has_no_watch = error == boost::system::errc::no_space_on_device;
    if (has_no_watch)
        upstreams_.watches().has_failed();
    bool const is_ours = error == asio::error::no_descriptors ||
                         error == boost::system::errc::too_many_files_open_in_system || has_no_watch ||
                         error == asio::error::no_buffer_space || error == asio::error::no_memory;
    return Failure(is_ours ? errc::unavailable : errc::unreachable, error.message());
}

asio::awaitable<result<>> UpstreamSocket::connect(Upstream const& upstream)
{
    result<> reached;
    if (!upstreams_.watches().may_watch())
        reached = unreachable(make_error_code(boost::system::errc::no_space_on_device));
    else if (upstream.broker.empty())
        reached = co_await connect_directly(upstream);
    else
        reached = co_await connect_through(upstream.broker.string());
    if (!reached)
        co_return reached;
    // Closed meanwhile: what was opened since then goes, too.
    if (is_closed_) {
        close();
        co_return Failure(errc::closed);
    }
    boost::system::error_code ignored;
    stream_.socket().native_non_blocking(true, ignored);
    stream_.socket().set_option(tcp::no_delay(true), ignored);
    if (upstream.tls)
        reached = co_await encrypt(upstream);
    co_return reached;
}

asio::awaitable<result<>> UpstreamSocket::connect_directly(Upstream const& upstream)
{
    result<Addresses> addresses;
    boost::system::error_code not_numeric;
    auto const address = asio::ip::make_address(upstream.host, not_numeric);
    // Names need TLS: a certificate says who was reached, a plain connection only what the name service says.
    if (!not_numeric)
        addresses->push_back(address);
    else if (upstream.tls)
        addresses = co_await resolve(upstream.host);
    else
        addresses = Failure(errc::unreachable, concat("\"", upstream.host, "\" is not a numeric address"));
    if (!addresses)
        co_return addresses.error();
    if (upstream.elsewhere)
        if (auto const kept = keep_those_elsewhere(*addresses, upstream.host); !kept)
            co_return kept;
    boost::system::error_code failed = asio::error::host_not_found;
    for (auto const& each : *addresses) {
        if (is_closed_)
            co_return Failure(errc::closed);
        // A socket that has failed to connect can't try again; connecting opens a new one.
        boost::system::error_code ignored;
        stream_.socket().close(ignored);
        auto const [error] =
            co_await stream_.socket().async_connect(tcp::endpoint(each, upstream.port), without_throwing);
        failed = error;
        if (!failed)
            co_return result<>();
    }
    co_return unreachable(failed);
}

/// As `Upstreams::resolve`, until this is closed.
asio::awaitable<result<Addresses>> UpstreamSocket::resolve(std::string name)
{
    auto resolving = upstreams_.resolve(std::move(name));
    auto token = asio::bind_cancellation_slot(resolving_.slot(), asio::use_awaitable);
    try {
        auto const executor = stream_.socket().get_executor();
        auto operation = asio::co_spawn(executor, std::move(resolving), std::move(token));
        auto addresses = co_await std::move(operation);
        co_return addresses;
    } catch (boost::system::system_error const&) { // closed before it began
        co_return Failure(errc::closed);
    }
}

asio::awaitable<result<>> UpstreamSocket::encrypt(Upstream const& upstream)
{
    auto tls = upstreams_.begin(upstream);
    if (!tls)
        co_return tls.error();
    stream_.encrypt(std::move(*tls));
    auto const failed = co_await stream_.handshake();
    if (is_closed_)
        co_return Failure(errc::closed);
    if (failed) {
        upstreams_.count_failure();
        co_return Failure(errc::unreachable,
                          handshake_problem(stream_.tls(), stream_.handshake_error(), failed.message()));
    }
    upstreams_.count_handshake(stream_.tls());
    upstream_ = &upstream;
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
    // While the queue of those who wait to be accepted is full, the kernel refuses at once (EAGAIN), and no
    // event tells when there is room.
    while (::connect(broker_.native_handle(), reinterpret_cast<sockaddr const*>(&address), sizeof address) !=
           0) {
        error = socket_error();
        if (error != asio::error::would_block)
            co_return unreachable(error);
        retry_.expires_after(retry_after);
        (void)co_await retry_.async_wait(without_throwing);
        if (is_closed_)
            co_return Failure(errc::closed);
    }
    // The broker answers with a socket that is connected to the simulation, or closes this one.
    auto const [waited] =
        co_await broker_.async_wait(asio::local::stream_protocol::socket::wait_read, without_throwing);
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
        stream_.socket().assign(tcp::v4(), descriptor, error);
    else
        error = asio::error::not_socket;
    if (!error)
        return {};
    ::close(descriptor);
    return unreachable(error);
}

asio::awaitable<boost::system::error_code> UpstreamSocket::write(std::string_view bytes)
{
    return stream_.write(bytes);
}

asio::awaitable<std::pair<boost::system::error_code, std::size_t>> UpstreamSocket::read_some(char* to,
                                                                                             std::size_t size)
{
    auto const got = co_await stream_.read_some(asio::buffer(to, size));
    // The server says how to resume the session before it says anything else.
    if (auto const* const upstream = std::exchange(upstream_, nullptr); upstream && !got.first)
        upstreams_.keep_session(*upstream, stream_.tls());
    co_return got;
}

void UpstreamSocket::close() noexcept
{
    is_closed_ = true;
    boost::system::error_code ignored;
    stream_.close();
    broker_.close(ignored);
    retry_.cancel();
    resolving_.emit(asio::cancellation_type::terminal);
}

} // namespace webots_cloud::adapters
