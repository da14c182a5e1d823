// The operator gives commands over a Unix socket, where the kernel says which user and process asks: the
// server's own user or root, but no descendant of the server, since those are simulations. See
// docs/decisions/008-who-is-the-operator.md.
#include "operator_socket.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "adapters/host/epoll_watches.hpp"
#include "adapters/messages/forward_text.hpp"
#include "adapters/messages/http_request_reader.hpp"
#include "adapters/messages/http_response_text.hpp"
#include "async/cancellation.hpp"
#include "core/access/accept_failure.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/operator.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/error.hpp>

#include <sys/poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <fstream>
#include <optional>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace fs = std::filesystem;
using core::concat;
using Protocol = asio::local::stream_protocol;
using Stream = beast::basic_stream<Protocol>;

constexpr std::string_view too_long = "its path is too long: set XDG_RUNTIME_DIR to a shorter one";
constexpr auto patience = std::chrono::seconds(5); // for a request, and for its answer to be taken
constexpr std::size_t max_answer = 16 * 1024 * 1024;
constexpr int max_ancestors = 256;                            // that are looked up
constexpr int max_waiting = 8;                                // connections
constexpr auto pause_after_failure = std::chrono::seconds(1); // to accept one

std::string last_error()
{
    return std::error_code(errno, std::generic_category()).message();
}

/// The parent of a process, as proc(5) has it; nothing when it has gone.
std::optional<pid_t> parent_of(pid_t process)
{
    std::ifstream file("/proc/" + std::to_string(process) + "/stat");
    std::string stat;
    std::getline(file, stat);
    auto const name_end =
        stat.rfind(')'); // the name may hold anything; then come a blank, the state and a blank
    if (name_end == std::string::npos || name_end + 4 > stat.size())
        return std::nullopt;
    pid_t parent = 0;
    auto const [end, error] = std::from_chars(stat.data() + name_end + 4, stat.data() + stat.size(), parent);
    return error == std::errc() ? std::optional(parent) : std::nullopt;
}

#ifndef SO_PEERPIDFD
#define SO_PEERPIDFD 77 // since Linux 6.5
#endif

/// Whether the process that connected has ended: somebody else may have its number by now. False also where
/// the kernel can't tell.
bool has_ended(int connection)
{
    int process = -1;
    socklen_t size = sizeof process;
    if (::getsockopt(connection, SOL_SOCKET, SO_PEERPIDFD, &process, &size) != 0)
        return errno != ENOPROTOOPT;
    adapters::FileDescriptor const owned(process);
    pollfd ended{process, POLLIN, 0};
    return ::poll(&ended, 1, 0) != 0;
}

/// True for what we have started, and whatever that has started: simulations can't leave the tree of their
/// guard. Also true when it can't be told.
bool is_descendant(pid_t process)
{
    auto const us = ::getpid();
    for (int i = 0; i < max_ancestors; ++i) {
        if (process == us)
            return true;
        if (process <= 1)
            return false;
        auto const parent = parent_of(process);
        if (!parent)
            return true;
        process = *parent;
    }
    return true;
}

/// Why the other end of a connection is not the operator; empty when it is.
std::string refusal(Protocol::socket& socket)
{
    ucred peer{};
    socklen_t size = sizeof peer;
    if (::getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0)
        return last_error();
    if (peer.uid != 0 && peer.uid != ::geteuid())
        return concat("user ", std::to_string(peer.uid), " is not ours");
    // Nothing that we started becomes root, unless root wants it to; and root's processes may be hidden from
    // us.
    if (peer.uid == 0 && ::geteuid() != 0)
        return {};
    // The process must live after its parents were looked up, or these were of another one.
    if (is_descendant(peer.pid) || has_ended(socket.native_handle()))
        return concat("process ", std::to_string(peer.pid), " belongs to a simulation, or has ended");
    return {};
}

/// A Unix socket that only the operator gets an answer on.
class LocalOperatorSocket final : public OperatorSocket
{
public:
    LocalOperatorSocket(asio::any_io_executor const& executor, fs::path path, Logger log)
        : path_(std::move(path)), log_(std::move(log)), acceptor_(executor)
    {}
    ~LocalOperatorSocket() override { close(); }

    result<> listen() override;
    asio::awaitable<result<>> run(Endpoint& endpoint) override;

private:
    asio::awaitable<void> serve(Protocol::socket socket, Endpoint& endpoint);
    void close();

    fs::path path_;
    Logger log_;
    Protocol::acceptor acceptor_;
    ino_t inode_ = 0; ///< Of our socket: at the end only that is removed.
};

result<> LocalOperatorSocket::listen()
{
    auto const failed = [this](std::string_view why) {
        acceptor_ = Protocol::acceptor(acceptor_.get_executor());
        return Failure(errc::unavailable, concat("the operator's socket ", path_.string(), ": ", why));
    };
    if (path_.native().size() >= sizeof(sockaddr_un::sun_path))
        return failed(too_long);
    auto const folder = path_.parent_path();
    struct stat found;
    if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
        return failed(last_error());
    if (::stat(folder.c_str(), &found) != 0)
        return failed(last_error());
    // Anybody who may rename what is in the folder could put a socket of their own in place of ours.
    bool const is_shared = (found.st_mode & (S_IWGRP | S_IWOTH)) != 0 && (found.st_mode & S_ISVTX) == 0;
    if (is_shared || (found.st_uid != 0 && found.st_uid != ::geteuid()))
        return failed("others can replace what is in this folder");
    if (::lstat(path_.c_str(), &found) == 0 && S_ISSOCK(found.st_mode))
        ::unlink(path_.c_str()); // of a server that has died: this port is ours
    boost::system::error_code code;
    acceptor_.open(Protocol(), code);
    if (!code)
        acceptor_.bind(Protocol::endpoint(path_.string()), code);
    // In time: nobody can connect before `listen`.
    if (!code && ::chmod(path_.c_str(), 0600) != 0)
        code.assign(errno, boost::system::system_category());
    if (!code)
        acceptor_.listen(max_waiting, code);
    if (code)
        return failed(code.message());
    if (::lstat(path_.c_str(), &found) == 0)
        inode_ = found.st_ino;
    return {};
}

void LocalOperatorSocket::close()
{
    struct stat found;
    if (inode_ != 0 && ::lstat(path_.c_str(), &found) == 0 && found.st_ino == inode_)
        ::unlink(path_.c_str());
    inode_ = 0;
}

/// One connection after the other: only the operator is accepted, and each has a deadline.
asio::awaitable<result<>> LocalOperatorSocket::run(Endpoint& endpoint)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    if (!acceptor_.is_open()) { // `listen` said why: the server goes on without
        asio::steady_timer end(acceptor_.get_executor(), asio::steady_timer::time_point::max());
        (void)co_await end.async_wait(asio::as_tuple(asio::use_awaitable));
        co_return Failure(asio::error::operation_aborted);
    }
    bool cancelled = false;
    while (!cancelled) {
        auto [error, socket] = co_await acceptor_.async_accept(asio::as_tuple(asio::use_awaitable));
        cancelled = co_await async::is_cancelled();
        if (cancelled)
            break;
        if (error) { // no descriptor is left, say: that passes, and the server and its simulations go on
            log_.warning(
                LogCause("operator's socket"),
                core::describe_accept_failure("a connection to the operator's socket", error.value()));
            asio::steady_timer pause(acceptor_.get_executor(), pause_after_failure);
            (void)co_await pause.async_wait(asio::as_tuple(asio::use_awaitable));
            cancelled = co_await async::is_cancelled();
            continue;
        }
        if (auto const why = refusal(socket); !why.empty())
            log_.warning(LogCause("operator's socket"),
                         concat("Refused a connection to the operator's socket: ", why));
        else
            co_await serve(std::move(socket), endpoint);
        cancelled = co_await async::is_cancelled(); // what ended `serve` early does not end the next accept
    }
    co_return Failure(asio::error::operation_aborted);
}

/// Anything but one whole request is not answered.
asio::awaitable<void> LocalOperatorSocket::serve(Protocol::socket socket, Endpoint& endpoint)
{
    using Progress = adapters::HttpRequestReader::Progress;
    Stream stream(std::move(socket));
    stream.expires_after(patience);
    adapters::HttpRequestReader reader;
    auto progress = Progress::need_more;
    while (progress == Progress::need_more) {
        auto const room = reader.prepare();
        auto const [error, size] = co_await stream.async_read_some(asio::buffer(room.data(), room.size()),
                                                                   asio::as_tuple(asio::use_awaitable));
        if (error)
            co_return;
        reader.commit(size);
        progress = reader.parse();
    }
    if (progress != Progress::complete)
        co_return;
    auto request = reader.request();
    request.is_operator = true;
    auto answer = endpoint.respond(request);
    auto* const response = std::get_if<HttpResponse>(&answer);
    if (response && response->shared)
        response->body = response->shared->text;
    std::string text;
    adapters::append_response(text, response ? *response : HttpResponse(400, {}, {}), false,
                              request.method != "HEAD");
    stream.expires_after(patience);
    (void)co_await asio::async_write(stream, asio::buffer(text), asio::as_tuple(asio::use_awaitable));
}

/// What `--drain` and its like ask: in a program of their own, which may wait.
asio::awaitable<result<std::string>> ask(Protocol::endpoint where, std::string_view method,
                                         std::string_view target)
{
    Stream stream(co_await asio::this_coro::executor);
    stream.expires_after(patience);
    auto const [unreachable] = co_await stream.async_connect(where, asio::as_tuple(asio::use_awaitable));
    if (unreachable)
        co_return Failure(errc::unreachable, unreachable.message());
    auto const request = concat(method, " ", target, " HTTP/1.1\r\nHost: localhost\r\n\r\n");
    auto const [unsent, sent] =
        co_await asio::async_write(stream, asio::buffer(request), asio::as_tuple(asio::use_awaitable));
    if (unsent)
        co_return Failure(errc::unreachable, unsent.message());
    std::string received; // all of it: the server closes after its answer
    std::array<char, 8192> piece{};
    boost::system::error_code ended;
    while (!ended && received.size() < max_answer) {
        auto const [error, size] =
            co_await stream.async_read_some(asio::buffer(piece), asio::as_tuple(asio::use_awaitable));
        received.append(piece.data(), size);
        ended = error;
    }
    if (ended == beast::error::timeout)
        co_return Failure(errc::timed_out, "the server has taken the request, and says nothing");
    adapters::ForwardedResponse response(UpstreamKind::trusted_monitor, false, false);
    bool const is_whole = response.parse(received) == adapters::ForwardedResponse::Progress::complete &&
                          received.size() == response.head_size() + response.length();
    if (!is_whole)
        co_return Failure(errc::refused,
                          "the server does not take it from this user, or from within a simulation");
    auto body = received.substr(response.head_size());
    if (response.status() != 200)
        co_return Failure(errc::invalid_argument, core::printable(body));
    co_return body;
}

} // namespace

std::unique_ptr<OperatorSocket> make_operator_socket(asio::any_io_executor executor, fs::path path,
                                                     Logger log)
{
    return std::make_unique<LocalOperatorSocket>(std::move(executor), std::move(path), std::move(log));
}

namespace adapters {

result<std::string> ask_operator_socket(fs::path const& path, std::string_view method,
                                        std::string_view target)
{
    if (path.native().size() >= sizeof(sockaddr_un::sun_path))
        return Failure(errc::invalid_argument, concat(path.string(), ": ", too_long));
    if (auto const found = find_watches(); !found)
        return found.error();
    asio::io_context context;
    result<std::string> outcome = Failure(errc::timed_out);
    asio::co_spawn(context, ask(Protocol::endpoint(path.string()), method, target),
                   [&outcome](std::exception_ptr failed, result<std::string> answer) {
                       if (failed)
                           std::rethrow_exception(failed);
                       outcome = std::move(answer);
                   });
    context.run();
    return outcome;
}

} // namespace adapters

} // namespace webots_cloud
