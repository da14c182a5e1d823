// Programs run by the guard, and ports reserved for them. Protocol sections 4.3 (quirk Q9), 6.1, 6.4
// and 6.5 (Q15); what becomes of their children is in tests/integration/guard_test.py.
#include "unit_test.hpp"

#include "adapters/process/listening_ports.hpp"
#include "adapters/process/process_tree.hpp"
#include "adapters/process/process_usage.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/use_future.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <utility>
#include <variant>

using namespace webots_cloud;
namespace asio = boost::asio;
namespace fs = std::filesystem;
using asio::ip::tcp;

namespace {

/// What a program printed, and how it ended.
struct Outcome
{
    Outcome() = default;

    std::string output;
    ExitStatus status;
    int reports = 0; ///< That it listens.
};

/// Reads until the program ends, or has printed `text`.
asio::awaitable<Outcome> watch(Process& process, std::string text)
{
    Outcome outcome;
    while (text.empty() || outcome.output.find(text) == std::string::npos) {
        auto const event = co_await process.next_event();
        if (!event)
            break;
        if (auto const* status = std::get_if<ExitStatus>(&*event)) {
            outcome.status = *status;
            break;
        }
        if (auto const* printed = std::get_if<ProcessOutput>(&*event))
            outcome.output += printed->bytes;
        else
            ++outcome.reports;
    }
    co_return outcome;
}

/// Reads until the program is said to listen.   Returns: whether that has been said.
asio::awaitable<bool> watch_for_listener(Process& process)
{
    for (;;) {
        auto const event = co_await process.next_event();
        if (!event || std::holds_alternative<ExitStatus>(*event))
            co_return false;
        if (std::holds_alternative<ProcessListens>(*event))
            co_return true;
    }
}

/// Stops a process that the guard has just begun to make, as a rule before its first instruction.
void stop_first_child(pid_t guard)
{
    auto const id = std::to_string(guard);
    int const children = ::open(("/proc/" + id + "/task/" + id + "/children").c_str(), O_RDONLY);
    BOOST_TEST_REQUIRE(children >= 0);
    std::array<char, 32> text{};
    while (::pread(children, text.data(), text.size() - 1, 0) <= 0)
        continue;
    ::close(children);
    BOOST_TEST_REQUIRE(::kill(std::atoi(text.data()), SIGSTOP) == 0);
}

struct ProcessHostFixture
{
    ProcessHostFixture()
    {
        fs::create_directory(folder);
        spec.directory = folder;
    }
    ~ProcessHostFixture() { fs::remove_all(folder); }

    template<class T>
    T run(asio::awaitable<T> body)
    {
        auto outcome = asio::co_spawn(context, std::move(body), asio::use_future);
        context.restart();
        context.run();
        return outcome.get();
    }

    result<std::unique_ptr<Process>> start(std::vector<std::string> argv)
    {
        spec.argv = std::move(argv);
        return run(host->start(spec));
    }

    std::unique_ptr<Process> start_shell(std::string script)
    {
        auto started = start({"/bin/sh", "-c", std::move(script)});
        BOOST_TEST_REQUIRE(started.has_value());
        return std::move(*started);
    }

    Outcome watch_shell(std::string script)
    {
        auto const process = start_shell(std::move(script));
        return run(watch(*process, ""));
    }

    /// A program that has printed a line, and will listen in a network of its own. Null: there can be none.
    std::unique_ptr<Process> start_listener()
    {
        tcp::acceptor free(context, tcp::endpoint(tcp::v4(), 0));
        spec.network.reach = ProcessNetwork::Reach::none;
        spec.network.port = free.local_endpoint().port();
        free.close();
        auto process = start_shell("echo ready; exec /usr/bin/python3 -c \"import signal, socket; server = "
                                   "socket.create_server(('', " +
                                   std::to_string(spec.network.port) + ")); signal.pause()\"");
        if (run(watch(*process, "ready\n")).status == ExitStatus())
            return process;
        BOOST_TEST_MESSAGE("skipped: networks can't be made here");
        return nullptr;
    }

    /// What keeps us from being connected.
    boost::system::error_code connect_to(std::uint16_t port)
    {
        tcp::socket socket(context);
        boost::system::error_code error;
        socket.connect(tcp::endpoint(asio::ip::address_v4::loopback(), port), error);
        return error;
    }

    fs::path folder = fs::canonical(fs::temp_directory_path()) /
                      ("webots_cloud_process_host_" + std::to_string(::getpid()));
    ProcessSpec spec;
    asio::io_context context{1};
    std::unique_ptr<ProcessHost> host = make_process_host(context.get_executor(), PROCESS_GUARD);
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(process_host, ProcessHostFixture)

// 6.1: standard error is merged with the output, in the order of writing.
BOOST_AUTO_TEST_CASE(output_and_errors_come_in_the_order_of_their_writing)
{
    auto const outcome = watch_shell("printf a; printf 'b\\377\\n' >&2; printf c");
    BOOST_TEST(outcome.output == "ab\xff\nc");
    BOOST_TEST((outcome.status == ExitStatus(0, false)));
}

BOOST_AUTO_TEST_CASE(a_program_runs_in_its_directory_with_the_given_environment_alone_and_no_input)
{
    BOOST_TEST(watch_shell("pwd -P; read line || echo none").output == folder.string() + "\nnone\n");
    spec.environment = {{"DISPLAY", ":7"}, {"B", "two words"}};
    auto const process = start({"/usr/bin/env"});
    BOOST_TEST_REQUIRE(process.has_value());
    BOOST_TEST(run(watch(**process, "")).output == "DISPLAY=:7\nB=two words\n");
}

BOOST_AUTO_TEST_CASE(without_a_directory_it_is_ours)
{
    spec.directory.clear();
    BOOST_TEST(watch_shell("pwd -P").output == fs::canonical(fs::current_path()).string() + "\n");
}

BOOST_AUTO_TEST_CASE(nothing_is_no_program)
{
    BOOST_TEST((start({}).error() == errc::invalid_argument));
}

BOOST_AUTO_TEST_CASE(relative_paths_of_programs_start_at_our_directory_not_at_theirs)
{
    host = make_process_host(context.get_executor(), fs::relative(PROCESS_GUARD));
    auto const process = start({fs::relative("/bin/echo").string(), "here"});
    BOOST_TEST_REQUIRE(process.has_value());
    BOOST_TEST(run(watch(**process, "")).output == "here\n");
}

BOOST_AUTO_TEST_CASE(a_program_has_no_descriptor_of_ours)
{
    auto const hold = host->hold_port(0); // a descriptor without close-on-exec
    BOOST_TEST_REQUIRE(hold.has_value());
    auto const look = "for n in 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19; do "
                      "if [ -e /proc/self/fd/$n ]; then echo $n; fi; done; echo none";
    BOOST_TEST(watch_shell(look).output == "none\n");
}

// 6.5: a SIGSTOP keeps nothing alive, not even when it comes after the program was asked to end.
BOOST_AUTO_TEST_CASE(a_guard_that_is_stopped_after_it_was_asked_ends_its_program_all_the_same)
{
    spec.grace = std::chrono::milliseconds(100);
    auto const process = start_shell("trap '' TERM; echo ready; while :; do sleep 1; done");
    run(watch(*process, "ready\n"));
    process->terminate();
    BOOST_TEST_REQUIRE(::kill(process->id(), SIGSTOP) == 0);
    BOOST_TEST((run(watch(*process, "")).status == ExitStatus(SIGKILL, true)));
}

BOOST_AUTO_TEST_CASE(a_guard_that_is_stopped_after_it_was_let_go_ends_all_the_same)
{
    auto process = start_shell("echo ready; while :; do sleep 1; done");
    run(watch(*process, "ready\n"));
    auto const guard = process->id();
    process.reset();
    (void)::kill(guard, SIGSTOP); // it may come before or after the guard has ended
    context.restart();
    context.run(); // until the exit was reported
    BOOST_TEST(::kill(guard, 0) != 0);
}

BOOST_AUTO_TEST_CASE(a_process_that_is_stopped_as_it_begins_does_not_keep_its_guard_from_hearing_us)
{
    spec.grace = std::chrono::milliseconds(100);
    auto const process = start_shell("trap '' TERM; while :; do sleep 1; done");
    stop_first_child(process->id());
    process->terminate();
    BOOST_TEST(run(watch(*process, "")).status.signalled);
}

BOOST_AUTO_TEST_CASE(a_guard_that_is_killed_while_its_first_process_is_stopped_leaves_nothing)
{
    auto const process = start_shell("while :; do sleep 1; done");
    stop_first_child(process->id());
    BOOST_TEST_REQUIRE(::kill(process->id(), SIGKILL) == 0);
    BOOST_TEST((run(watch(*process, "")).status == ExitStatus(SIGKILL, true)));
}

BOOST_AUTO_TEST_CASE(what_a_killed_guard_has_left_behind_is_ended)
{
    if (::geteuid() != 0) {
        BOOST_TEST_MESSAGE("skipped: only root may look into the descriptors of all processes");
        return;
    }
    auto const guard = folder / "guard";
    std::ofstream(guard)
        << "#!/bin/sh\nsetsid sleep 600 &\nexec kill -KILL $$\n"; // the output ends with both
    BOOST_TEST_REQUIRE(::chmod(guard.c_str(), 0755) == 0);
    host = make_process_host(context.get_executor(), guard);
    BOOST_TEST((watch_shell("").status == ExitStatus(SIGKILL, true)));
}

BOOST_AUTO_TEST_CASE(how_a_program_ended_is_told_again_and_again)
{
    auto const process = start_shell("exit 3");
    BOOST_TEST((run(watch(*process, "")).status == ExitStatus(3, false)));
    BOOST_TEST((run(watch(*process, "")).status == ExitStatus(3, false)));
    BOOST_TEST((watch_shell("kill -KILL $$").status == ExitStatus(SIGKILL, true)));
}

// Q15: a simulator that is missing.
BOOST_AUTO_TEST_CASE(a_program_that_is_not_there_is_named)
{
    auto const started = start({"/nowhere/webots"});
    BOOST_TEST_REQUIRE(!started.has_value());
    BOOST_TEST((started.error() == errc::start_failed));
    BOOST_TEST(
        started.error().message().ends_with("/nowhere/webots can't be run: No such file or directory"));
}

BOOST_AUTO_TEST_CASE(a_file_that_is_no_program_says_so_and_ends_as_in_a_shell)
{
    auto const path = folder / "webots";
    std::ofstream(path) << "#!/nowhere/interpreter\n";
    BOOST_TEST_REQUIRE(::chmod(path.c_str(), 0755) == 0);
    auto const process = start({path.string()});
    BOOST_TEST_REQUIRE(process.has_value());
    auto const outcome = run(watch(**process, ""));
    BOOST_TEST(outcome.output == "can't run " + path.string() + ": No such file or directory\n");
    BOOST_TEST((outcome.status == ExitStatus(127, false)));
}

// 6.5: SIGTERM first.
BOOST_AUTO_TEST_CASE(a_program_that_is_asked_to_end_may_say_goodbye)
{
    spec.grace = std::chrono::minutes(10); // longer than the test may take
    auto const process =
        start_shell("trap 'echo bye; exit 4' TERM; echo ready; while :; do /bin/sleep 600 & wait; done");
    BOOST_TEST(run(watch(*process, "ready\n")).output == "ready\n");
    process->terminate();
    auto const outcome = run(watch(*process, ""));
    BOOST_TEST(outcome.output == "bye\n");
    BOOST_TEST((outcome.status == ExitStatus(4, false)));
}

BOOST_AUTO_TEST_CASE(a_program_that_does_not_end_is_killed_after_the_grace)
{
    spec.grace = std::chrono::milliseconds(10);
    auto const process = start_shell("trap '' TERM; echo ready; while :; do /bin/sleep 600; done");
    BOOST_TEST(run(watch(*process, "ready\n")).output == "ready\n");
    process->terminate();
    BOOST_TEST((run(watch(*process, "")).status == ExitStatus(SIGKILL, true)));
}

BOOST_AUTO_TEST_CASE(a_program_that_nobody_holds_any_more_is_killed_at_once_without_a_word)
{
    spec.grace = std::chrono::minutes(10);
    auto process =
        start_shell("trap 'echo >bye; exit' TERM; echo ready; while :; do /bin/sleep 600 & wait; done");
    BOOST_TEST(run(watch(*process, "ready\n")).output == "ready\n");
    auto const guard = process->id();
    process.reset();
    context.restart();
    context.run(); // until the guard has ended, which is when nothing of the tree is left
    BOOST_TEST(::kill(guard, 0) != 0);
    BOOST_TEST(!fs::exists(folder / "bye"));
}

// Sampling the usage and the ports of a simulation takes bounded time, however many processes it has.
BOOST_AUTO_TEST_CASE(of_many_processes_some_are_looked_at_and_it_is_said)
{
    auto const process =
        start_shell("for i in 1 2 3 4 5 6 7 8 9; do /bin/sleep 600 & done; echo ready; wait");
    run(watch(*process, "ready\n"));
    auto const whole = run(process->usage());
    BOOST_TEST(whole.complete);
    BOOST_TEST(whole.memory_bytes > 0u);
    auto const part = adapters::process_usage(process->id(), 5);
    BOOST_TEST(!part.complete);
    BOOST_TEST(part.memory_bytes > 0u);
    BOOST_TEST(adapters::process_tree(process->id(), 5).processes.size() == 5u);
    BOOST_TEST(adapters::process_tree(process->id(), 100).processes.size() > 9u);
}

BOOST_AUTO_TEST_CASE(a_program_that_crashes_leaves_no_core_file)
{
    auto const process = start_shell("ulimit -Hc; ulimit -Sc; echo ready; /bin/sleep 600");
    BOOST_TEST(run(watch(*process, "ready\n")).output == "0\n0\nready\n");
}

// Their numbers are more than one read of the kernel's list, in which those of a limit could be hidden.
BOOST_AUTO_TEST_CASE(however_many_children_a_process_has_all_are_counted)
{
    constexpr std::size_t children = 1200; // of at least four bytes each
    auto const process = start_shell("i=0; while [ $i -lt " + std::to_string(children) +
                                     " ]; do /bin/sleep 600 & i=$((i+1)); done; echo ready; wait");
    run(watch(*process, "ready\n"));
    auto const tree = adapters::process_tree(process->id(), 2 * children);
    BOOST_TEST(tree.is_whole);
    BOOST_TEST(tree.processes.size() > children);
    auto const unique = std::set<pid_t>(tree.processes.begin(), tree.processes.end());
    BOOST_TEST(unique.size() == tree.processes.size());
    BOOST_TEST(adapters::process_usage(process->id(), 2 * children).processes > children);
    auto const part = adapters::process_tree(process->id(), children);
    BOOST_TEST(!part.is_whole);
    BOOST_TEST(part.processes.size() == children);
}

namespace {

/// Knows of the shell alone.
class ShellGraphics final : public GraphicsTimes
{
public:
    Duration busy(std::span<int const> processes) const override
    {
        return std::chrono::seconds(3) * static_cast<int>(processes.size());
    }
};

} // namespace

BOOST_AUTO_TEST_CASE(what_all_processes_of_a_tree_use_of_graphics_processors_is_asked)
{
    host = make_process_host(context.get_executor(), PROCESS_GUARD, {}, nullptr,
                             std::make_shared<ShellGraphics>());
    auto const process = start_shell("/bin/sleep 600 & echo ready; wait");
    run(watch(*process, "ready\n"));
    auto const tree = adapters::process_tree(process->id(), 100).processes.size();
    BOOST_TEST((run(process->usage()).graphics == std::chrono::seconds(3) * static_cast<int>(tree)));
}

// The program and its port are in a network of their own, whose guard relays connections: only it knows when.
BOOST_AUTO_TEST_CASE(a_guard_that_relays_a_port_says_when_whoever_connects_reaches_the_program)
{
    auto const process = start_listener();
    if (!process)
        return;
    BOOST_TEST((process->listening() == Listening::no));
    BOOST_TEST_REQUIRE(run(watch_for_listener(*process)));
    BOOST_TEST((process->listening() == Listening::yes));
    BOOST_TEST(!connect_to(spec.network.port)); // the first attempt succeeds
    process->terminate();
    BOOST_TEST(run(watch(*process, "")).reports == 0); // it is said once
}

BOOST_AUTO_TEST_CASE(what_a_guard_says_while_nobody_reads_is_not_lost)
{
    auto const process = start_listener();
    if (!process)
        return;
    while (connect_to(spec.network.port))
        continue;
    BOOST_TEST(run(watch_for_listener(*process)));
}

BOOST_AUTO_TEST_CASE(of_a_program_in_the_network_of_the_machine_nobody_says_when_it_listens)
{
    auto const process = start_shell("echo ready; exec /bin/sleep 600");
    BOOST_TEST((process->listening() == Listening::unknown));
}

BOOST_AUTO_TEST_CASE(an_answer_may_come_when_the_process_has_gone)
{
    auto process = start_shell("echo ready; /bin/sleep 600");
    run(watch(*process, "ready\n"));
    auto usage = asio::co_spawn(context, process->usage(), asio::use_future);
    auto port = asio::co_spawn(context, process->listening_port(1, 65535), asio::use_future);
    context.restart();
    context.poll();
    process.reset();
    context.restart();
    context.run();
    BOOST_TEST(usage.get().complete);
    BOOST_TEST(port.get() == 0);
}

BOOST_AUTO_TEST_SUITE_END()

namespace {

/// A server's socket on `port` of every address; the error when it can't be had.
boost::system::error_code listen(tcp::acceptor& socket, std::uint16_t port, bool reuse_address)
{
    boost::system::error_code error;
    socket.open(tcp::v4(), error);
    socket.set_option(tcp::acceptor::reuse_address(reuse_address), error);
    socket.bind(tcp::endpoint(tcp::v4(), port), error);
    if (!error)
        socket.listen(1, error);
    return error;
}

struct Ports : ProcessHostFixture
{
    /// Holds a free port.
    std::uint16_t hold_some()
    {
        for (int attempt = 0; attempt < 100; ++attempt) {
            tcp::acceptor probe(context);
            BOOST_REQUIRE(!listen(probe, 0, false));
            auto const port = probe.local_endpoint().port();
            probe.close();
            if (auto held = host->hold_port(port)) { // another program may have taken it meanwhile
                hold = std::move(*held);
                return port;
            }
        }
        BOOST_FAIL("no port can be held");
        return 0;
    }

    boost::system::error_code try_to_listen(std::uint16_t port, bool reuse_address)
    {
        tcp::acceptor socket(context);
        return listen(socket, port, reuse_address);
    }

    std::unique_ptr<PortHold> hold;
};

} // namespace

// 4.3, Q9.
BOOST_FIXTURE_TEST_SUITE(held_ports, Ports)

BOOST_AUTO_TEST_CASE(nobody_else_can_have_a_port_that_is_held)
{
    auto const port = hold_some();
    BOOST_TEST(try_to_listen(port, true) == asio::error::address_in_use);
    BOOST_TEST(try_to_listen(port, false) == asio::error::address_in_use);
    auto const again = host->hold_port(port);
    BOOST_TEST((again.error() == errc::unavailable));
    BOOST_TEST(again.error().message().find("port " + std::to_string(port) + ": Address already in use") !=
               std::string::npos);
}

BOOST_AUTO_TEST_CASE(who_connects_to_a_port_that_is_held_is_refused_and_not_kept_waiting)
{
    auto const port = hold_some();
    tcp::socket browser(context);
    boost::system::error_code error;
    browser.connect(tcp::endpoint(asio::ip::address_v4::loopback(), port), error);
    BOOST_TEST(error == asio::error::connection_refused);
}

BOOST_AUTO_TEST_CASE(a_port_is_free_as_soon_as_it_is_given_up)
{
    auto const is_free_afterwards = [this] {
        auto const port = hold_some();
        hold.reset();
        return !try_to_listen(port, false);
    };
    // Several attempts, because another program may take the port first.
    BOOST_TEST((is_free_afterwards() || is_free_afterwards() || is_free_afterwards()));
}

BOOST_AUTO_TEST_CASE(a_port_that_somebody_listens_on_is_not_had)
{
    for (bool const reuse_address : {false, true}) {
        tcp::acceptor other(context);
        BOOST_REQUIRE(!listen(other, 0, reuse_address));
        BOOST_TEST((host->hold_port(other.local_endpoint().port()).error() == errc::unavailable));
    }
}

BOOST_AUTO_TEST_CASE(a_port_is_had_of_ipv6_too_where_browsers_look_for_localhost_first)
{
    tcp::acceptor other(context);
    boost::system::error_code no_ipv6;
    other.open(tcp::v6(), no_ipv6);
    if (!no_ipv6)
        other.bind(tcp::endpoint(asio::ip::address_v6::loopback(), 0), no_ipv6);
    if (no_ipv6) {
        BOOST_TEST_MESSAGE("skipped: this machine has no IPv6");
        return;
    }
    other.listen(1);
    BOOST_TEST((host->hold_port(other.local_endpoint().port()).error() == errc::unavailable));
    auto const port = hold_some();
    tcp::acceptor later(context, tcp::v6());
    boost::system::error_code refused;
    later.set_option(tcp::acceptor::reuse_address(true));
    later.bind(tcp::endpoint(asio::ip::address_v6::loopback(), port), refused);
    BOOST_TEST(refused == asio::error::address_in_use);
}

BOOST_AUTO_TEST_CASE(
    the_port_of_a_process_is_found_among_those_that_it_may_have_and_not_among_those_of_others)
{
    tcp::acceptor ours(context);
    BOOST_REQUIRE(!listen(ours, 0, false));
    auto const port = ours.local_endpoint().port();
    auto const next = static_cast<std::uint16_t>(port + 1);
    BOOST_TEST(adapters::listening_port(::getpid(), port, port) == port);
    BOOST_TEST(adapters::listening_port(::getpid(), static_cast<std::uint16_t>(port - 1), next) == port);
    auto const process = start_shell("echo ready; /bin/sleep 600");
    run(watch(*process, "ready\n"));
    BOOST_TEST(run(process->listening_port(port, port)) == 0); // another process listens there
    ours.close();
    BOOST_TEST(adapters::listening_port(::getpid(), port, port) == 0);
}

BOOST_AUTO_TEST_CASE(a_port_where_connections_have_just_ended_can_be_held)
{
    tcp::acceptor server(context);
    BOOST_REQUIRE(!listen(server, 0, true));
    auto const port = server.local_endpoint().port();
    tcp::socket browser(context);
    browser.connect(tcp::endpoint(asio::ip::address_v4::loopback(), port));
    auto connection = server.accept();
    connection.close(); // the side that closes first keeps the port in TIME_WAIT
    char byte = 0;
    boost::system::error_code end;
    browser.read_some(asio::buffer(&byte, 1), end);
    browser.close();
    server.close();
    BOOST_TEST(host->hold_port(port).has_value());
}

BOOST_AUTO_TEST_SUITE_END()
