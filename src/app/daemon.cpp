// What every program of ours does around its work: it raises the limit of descriptors, finds out whether it
// may have what it needs and whether its event loop can hear signals, runs until one arrives or the work
// ends, and says why it ends.
#include "daemon.hpp"
#include "adapters/host/epoll_watches.hpp"
#include "adapters/host/program_pages.hpp"
#include "adapters/threads/low_latency_scheduling.hpp"
#include "async/first_of.hpp"
#include "own_limits.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <iostream>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

namespace webots_cloud::app {
namespace {

namespace asio = boost::asio;

/// What the log is told of the end: the first cause of it, once.
struct Ending
{
    Logger log;
    bool is_told = false;
};

asio::awaitable<result<>> await_signal(asio::signal_set& signals, Ending& ending)
{
    auto const [cancelled, number] = co_await signals.async_wait(asio::as_tuple(asio::use_awaitable));
    if (cancelled)
        co_return Failure(cancelled);
    ending.is_told = true;
    ending.log.info(number == SIGTERM ? "Ending, as SIGTERM asks" : "Ending, as SIGINT asks");
    co_return result<>();
}

asio::awaitable<result<>> await_end(asio::awaitable<result<>> body, Ending& ending)
{
    auto const outcome = co_await std::move(body);
    if (!ending.is_told && outcome)
        ending.log.info("Ending, since all is done");
    if (!ending.is_told && !outcome)
        ending.log.error("Ending: " + terminal_text(outcome.error().message()));
    co_return outcome;
}

asio::awaitable<result<>> until_signal(asio::signal_set& signals, asio::awaitable<result<>> body, Logger log)
{
    Ending ending{std::move(log)};
    auto either = async::first_of(await_end(std::move(body), ending), await_signal(signals, ending));
    co_return co_await std::move(either);
}

// Room for all that most sites ever open at once; it takes half a megabyte of the kernel's memory.
constexpr rlim_t reserved_descriptors = 65'536;

/// Each browser, machine and simulation needs file descriptors: raises the limit as far as allowed.
///
/// The kernel's table of them is made large at once. By itself it grows whenever it is full, and then the
/// call that opens a descriptor in a process with threads waits for all processors (synchronize_rcu): the
/// event loop stood still for up to 22 ms.
void raise_descriptor_limit()
{
    rlimit limit{};
    if (::getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return;
    limit.rlim_cur = limit.rlim_max;
    ::setrlimit(RLIMIT_NOFILE, &limit);
    auto const last = static_cast<int>(std::min(limit.rlim_cur, reserved_descriptors)) - 1;
    int const used = ::dup(last);
    if (used < 0 && ::dup2(STDERR_FILENO, last) == last)
        ::close(last);
    if (used >= 0) // inherited: then the table is large already
        ::close(used);
}

constexpr auto longest_start = std::chrono::seconds(1); // of most; a longer one takes some pages again

/// Says why a program ends, and returns its exit status.
int report_failure(std::string const& name, Failure const& why)
{
    std::cerr << name << ": " << terminal_text(why.message()) << std::endl;
    bool const is_bad_configuration = why == errc::invalid_config || why == errc::invalid_argument;
    return is_bad_configuration       ? exit_usage
           : why == errc::unavailable ? exit_try_again // for instance a port in use
                                      : exit_failed;
}

} // namespace

int run_daemon(std::string const& name, std::function<asio::awaitable<result<>>(asio::any_io_executor)> body,
               Logger log)
{
    // Simulations may run as our user, and must not trace us, or read our memory and descriptors.
    ::prctl(PR_SET_DUMPABLE, 0);
    adapters::use_low_latency_scheduling();
    raise_descriptor_limit();
    std::signal(SIGCHLD, SIG_DFL); // our parent may have ignored it, and then no program could be waited for
    // To write to a browser that has gone is an error of that connection, not the end of the server.
    std::signal(SIGPIPE, SIG_IGN);
    // Until the body handles them: neither may end a server that is starting.
    std::signal(SIGHUP, SIG_IGN);
    std::signal(SIGUSR1, SIG_IGN);
    if (auto const enough = check_limits(own_limits()); !enough)
        return report_failure(name, enough.error());
    if (auto const found = adapters::find_watches(); !found)
        return report_failure(name, found.error());
    // Only one thread runs it and uses its sockets, so those need no locks; other threads may still post.
    asio::io_context context(BOOST_ASIO_CONCURRENCY_HINT_UNSAFE_IO);
    // Before the body starts, so that no early one is missed.
    asio::signal_set signals(context, SIGINT, SIGTERM);
    asio::steady_timer started(context, longest_start);
    started.async_wait([](boost::system::error_code ended) {
        if (!ended)
            adapters::release_program_pages();
    });
    int status = exit_failed;
    auto report = [&](std::exception_ptr failure, result<> const& outcome) {
        started.cancel();
        if (failure)
            std::rethrow_exception(failure);
        status = outcome ? exit_ok : report_failure(name, outcome.error());
    };
    asio::co_spawn(context, until_signal(signals, body(context.get_executor()), std::move(log)), report);
    context.run();
    return status;
}

std::filesystem::path program_folder()
{
    std::error_code failed;
    auto const program = std::filesystem::read_symlink("/proc/self/exe", failed);
    return failed ? std::filesystem::current_path() : program.parent_path();
}

} // namespace webots_cloud::app
