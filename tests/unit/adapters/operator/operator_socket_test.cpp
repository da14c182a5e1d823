#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/testing/recording_log.hpp>

#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include <linux/sched.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string_view>

using namespace webots_cloud;
namespace asio = boost::asio;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(operator_socket)

namespace {

#if defined(__SANITIZE_ADDRESS__)
constexpr bool is_sanitized = true;
#elif defined(__has_feature)
constexpr bool is_sanitized = __has_feature(address_sanitizer);
#else
constexpr bool is_sanitized = false;
#endif

/// Counts what reaches it.
class Counter final : public Endpoint
{
public:
    Answer respond(IncomingRequest const&) override
    {
        ++requests;
        return HttpResponse(200, "text/plain", "done");
    }
    asio::awaitable<void> serve_websocket(ChannelInfo, Channel&) override { co_return; }

    int requests = 0;
};

struct Folder
{
    Folder()
    {
        std::string name = "/tmp/webots_cloud_operator_XXXXXX";
        path = ::mkdtemp(name.data());
    }
    ~Folder() { fs::remove_all(path); }

    fs::path path;
};

/// A socket in a folder of its own.
struct Fixture
{
    Fixture() { BOOST_TEST_REQUIRE(server->listen().has_value()); }

    void run()
    {
        auto const at_end = [this](std::exception_ptr, result<> const&) { ended = true; };
        asio::co_spawn(context, server->run(endpoint), asio::bind_cancellation_slot(stop.slot(), at_end));
    }

    Folder const folder;
    fs::path const path = folder.path / "operator.sock";
    testing::RecordingLog log;
    Counter endpoint;
    bool ended = false;
    asio::io_context context;
    asio::cancellation_signal stop;
    std::unique_ptr<OperatorSocket> server = make_operator_socket(context.get_executor(), path, log.logger());
};

constexpr std::string_view drain = "POST /api/drain HTTP/1.1\r\nHost: x\r\n\r\n";

bool connect_to(int connection, fs::path const& path)
{
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    return ::connect(connection, reinterpret_cast<sockaddr const*>(&address), sizeof address) == 0;
}

bool ask_at(int connection, fs::path const& path)
{
    return connect_to(connection, path) &&
           ::write(connection, drain.data(), drain.size()) == static_cast<ssize_t>(drain.size());
}

/// Starts a process with this number that is not our descendant, and ends with `life`.   -1: not allowed.
pid_t start_elsewhere(pid_t number, int const (&life)[2])
{
    int told[2];
    BOOST_TEST_REQUIRE(::pipe(told) == 0);
    auto const between = ::fork();
    if (between == 0) {
        clone_args arguments{};
        arguments.exit_signal = SIGCHLD;
        arguments.set_tid = reinterpret_cast<std::uintptr_t>(&number);
        arguments.set_tid_size = 1;
        auto const started = static_cast<pid_t>(::syscall(SYS_clone3, &arguments, sizeof arguments));
        if (started == 0) {
            ::close(life[1]);
            char byte = 0;
            ::_exit(::read(life[0], &byte, 1) == 0 ? 0 : 1);
        }
        ::_exit(::write(told[1], &started, sizeof started) == sizeof started ? 0 : 1);
    }
    ::waitpid(between, nullptr, 0); // what it has started has other parents now
    pid_t started = -1;
    BOOST_TEST_REQUIRE(::read(told[0], &started, sizeof started) == static_cast<ssize_t>(sizeof started));
    ::close(told[0]);
    ::close(told[1]);
    return started;
}

/// Starts a process that is not our descendant: it connects, asks nothing, and ends with `life`.
bool connect_elsewhere(fs::path const& path, int const (&life)[2])
{
    int orphaned[2];
    int told[2];
    BOOST_TEST_REQUIRE(::pipe(orphaned) == 0);
    BOOST_TEST_REQUIRE(::pipe(told) == 0);
    auto const between = ::fork();
    if (between == 0) {
        if (::fork() != 0)
            ::_exit(0);
        char byte = 0;
        bool connected = ::read(orphaned[0], &byte, 1) == 1;
        int const connection = ::socket(AF_UNIX, SOCK_STREAM, 0);
        connected = connected && connect_to(connection, path);
        ::close(life[1]);
        bool const is_told = ::write(told[1], &connected, sizeof connected) == sizeof connected;
        ::_exit(is_told && ::read(life[0], &byte, 1) == 0 ? 0 : 1);
    }
    ::waitpid(between, nullptr, 0); // what it has started has other parents now
    bool connected = false;
    BOOST_TEST(::write(orphaned[1], "o", 1) == 1);
    BOOST_TEST(::read(told[0], &connected, sizeof connected) == static_cast<ssize_t>(sizeof connected));
    for (int const end : {orphaned[0], orphaned[1], told[0], told[1]})
        ::close(end);
    return connected;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_simulation_does_not_pass_for_a_process_that_has_got_the_number_of_its_own)
{
    Fixture f;

    int const connection = ::socket(AF_UNIX, SOCK_STREAM, 0);
    auto const simulation = ::fork(); // what we start counts as a simulation
    if (simulation == 0)
        ::_exit(ask_at(connection, f.path) ? 0 : 1);
    int status = -1;
    ::waitpid(simulation, &status, 0);
    BOOST_TEST_REQUIRE(status == 0);
    int life[2];
    BOOST_TEST_REQUIRE(::pipe(life) == 0);
    if (start_elsewhere(simulation, life) != simulation) {
        BOOST_TEST_MESSAGE("skipped: the number of a process can't be chosen here");
        return;
    }
    f.run();
    auto const deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (f.endpoint.requests == 0 && f.log.lines.empty() && std::chrono::steady_clock::now() < deadline)
        f.context.run_one_for(std::chrono::seconds(1));
    BOOST_TEST(f.endpoint.requests == 0);
    BOOST_TEST(f.log.contains("belongs to a simulation, or has ended"));
    ::close(connection);
    ::close(life[0]);
    ::close(life[1]);
}

// The cancellation ends the wait for the request; it must not be forgotten then.
BOOST_AUTO_TEST_CASE(a_server_that_is_stopped_while_somebody_is_connected_accepts_nobody_else)
{
    Fixture f;
    int life[2];
    BOOST_TEST_REQUIRE(::pipe(life) == 0);
    bool const connected = connect_elsewhere(f.path, life);
    BOOST_TEST_REQUIRE(connected);

    f.run();
    f.context.poll(); // it is connected already: now the server waits for its request
    BOOST_TEST(f.log.lines.empty());
    f.stop.emit(asio::cancellation_type::terminal);
    f.context.restart();
    auto const deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
    while (!f.ended && std::chrono::steady_clock::now() < deadline)
        f.context.run_one_for(std::chrono::seconds(1));
    BOOST_TEST(f.ended);
    ::close(life[0]);
    ::close(life[1]);
}

// A server ends when one of its parts does, with all its simulations.
BOOST_AUTO_TEST_CASE(a_connection_that_can_not_be_accepted_ends_nothing)
{
    if (is_sanitized) {
        BOOST_TEST_MESSAGE("skipped: the sanitizers need descriptors themselves, to look at objects");
        return;
    }
    Fixture f;
    f.run();
    f.context.poll();

    int const connection = ::socket(AF_UNIX, SOCK_STREAM, 0);
    rlimit usual{};
    BOOST_TEST_REQUIRE(::getrlimit(RLIMIT_NOFILE, &usual) == 0);
    auto none = usual;
    none.rlim_cur = 0;
    BOOST_TEST_REQUIRE(::setrlimit(RLIMIT_NOFILE, &none) == 0);
    bool const is_connected = connect_to(connection, f.path);
    f.context.restart();
    f.context.run_one();
    f.context.poll();
    ::setrlimit(RLIMIT_NOFILE, &usual);
    BOOST_TEST(is_connected);
    BOOST_TEST(f.log.contains("Can't accept a connection to the operator's socket: "));
    BOOST_TEST(!f.ended);

    f.stop.emit(asio::cancellation_type::terminal);
    f.context.restart();
    f.context.run_for(std::chrono::seconds(10));
    BOOST_TEST(f.ended);
    ::close(connection);
}

BOOST_AUTO_TEST_SUITE_END()
