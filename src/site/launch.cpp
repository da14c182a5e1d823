#include "launch.hpp"

#include "core/text.hpp"
#include "process_table.hpp"

#include <cerrno>
#include <csignal>
#include <system_error>
#include <thread>

#include <fcntl.h>
#include <unistd.h>

namespace webots_cloud::site {
namespace {

using core::concat;

volatile std::sig_atomic_t interruption = 0;

/// Signals wait while there is one: a child that is just being made would take them for our own.
class HeldSignals
{
public:
    HeldSignals() noexcept
    {
        sigset_t all;
        ::sigfillset(&all);
        ::pthread_sigmask(SIG_SETMASK, &all, &before_);
    }
    HeldSignals(HeldSignals const&) = delete;
    HeldSignals& operator=(HeldSignals const&) = delete;
    ~HeldSignals() { release(); }

    void release() const noexcept { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

private:
    sigset_t before_{};
};

/// In the child, where only what is safe after fork(2) may be called.
[[noreturn]] void become(std::vector<char*> const& arguments, int input, int console, HeldSignals const& held)
{
    ::setsid();
    ::dup2(input, STDIN_FILENO);
    ::dup2(console, STDOUT_FILENO);
    ::dup2(console, STDERR_FILENO);
    ::close_range(STDERR_FILENO + 1, ~0U, 0);
    for (int const number : {SIGINT, SIGTERM, SIGHUP, SIGPIPE})
        std::signal(number, SIG_DFL);
    held.release(); // one that has come ends the child here
    ::execv(arguments.front(), arguments.data());
    constexpr int not_found = 127;
    ::_exit(not_found);
}

} // namespace

void take_signals()
{
    for (int const number : {SIGINT, SIGTERM})
        std::signal(number, [](int which) { interruption = which; });
    for (int const number : {SIGHUP, SIGPIPE})
        std::signal(number, SIG_IGN);
    std::signal(SIGCHLD, SIG_DFL); // ignored, no program could be waited for
}

bool is_interrupted() noexcept
{
    return interruption != 0;
}

void open_standard_files()
{
    int file = 0;
    while (file >= 0 && file <= STDERR_FILENO) // the lowest number that is free
        file = ::open("/dev/null", O_RDWR);
    if (file > STDERR_FILENO)
        ::close(file);
}

result<pid_t> start_detached(std::vector<std::string> const& command, int console)
{
    auto words = command;
    std::vector<char*> arguments;
    for (auto& word : words)
        arguments.push_back(word.data());
    arguments.push_back(nullptr);
    int const input = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
    HeldSignals const held;
    pid_t const child = input < 0 ? -1 : ::fork();
    int const failure = errno;
    if (child == 0)
        become(arguments, input, console, held);
    ::close(input);
    ::close(console);
    if (child < 0)
        return Failure(errc::start_failed,
                       concat(command.front(), " can't be started: ",
                              std::error_code(failure, std::generic_category()).message()));
    return child;
}

result<> end_process(Process const& process, Duration limit)
{
    auto const deadline = std::chrono::steady_clock::now() + limit;
    if (is_alive(process) && ::kill(process.id, SIGTERM) != 0 && errno == EPERM)
        return Failure(errc::refused, "belongs to another user");
    while (is_alive(process)) {
        if (std::chrono::steady_clock::now() >= deadline)
            return Failure(errc::timed_out, "has not ended in time");
        pause_a_moment();
    }
    return {};
}

void pause_a_moment()
{
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
}

} // namespace webots_cloud::site
