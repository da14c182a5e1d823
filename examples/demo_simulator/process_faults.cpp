#include "process_faults.hpp"

#include "console.hpp"

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <string>

#include <sys/resource.h>
#include <unistd.h>

namespace webots_cloud::demo {
namespace {

/// A test that fails to kill a grandchild must not leave it behind for ever.
constexpr unsigned grandchild_seconds = 600;

void fork_grandchild(bool is_daemon)
{
    pid_t const child = ::fork();
    if (child < 0)
        return print_line("demo simulator: cannot fork a grandchild");
    if (child > 0)
        return print_line("demo simulator: " + std::string(is_daemon ? "daemon " : "") + "grandchild " +
                          std::to_string(child));
    if (is_daemon) {
        ::setsid();
        std::signal(SIGTERM, SIG_IGN);
    }
    ::alarm(grandchild_seconds);
    for (;;)
        ::pause();
}

} // namespace

void apply_process_faults(Faults const& faults)
{
    if (faults.grandchild)
        fork_grandchild(false);
    if (faults.daemon_grandchild)
        fork_grandchild(true);
    if (faults.ignore_sigterm)
        std::signal(SIGTERM, SIG_IGN);
}

void print_unusual_lines(Faults const& faults)
{
    using namespace std::string_view_literals;
    if (faults.long_lines)
        print_line(std::string(std::size_t{1} << 20, 'x'));
    if (faults.binary_lines)
        print_line("binary \xff\xfe\x80 \xc3\x28 \xed\xa0\x80 \x00 \x1b[31m end"sv);
}

void print_flood()
{
    static std::string const lines = [] {
        std::string text;
        while (text.size() < 65536)
            text += "demo simulator: flood flood flood flood flood flood flood flood\n";
        return text;
    }();
    print_bytes(lines);
}

void crash(std::string_view why)
{
    if (!why.empty())
        std::cerr << why << std::endl;
    rlimit const no_core{0, 0};
    ::setrlimit(RLIMIT_CORE, &no_core);
    std::signal(SIGSEGV, SIG_DFL);
    std::raise(SIGSEGV);
    std::abort(); // only if SIGSEGV is blocked
}

void hang()
{
    for (;;)
        ::pause();
}

void leave(Faults const& faults, int status)
{
    if (faults.no_final_newline)
        print_bytes("demo simulator: the last line has no newline");
    std::_Exit(status);
}

} // namespace webots_cloud::demo
