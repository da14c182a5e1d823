#include "unit_test.hpp"

#include "site/launch.hpp"

#include <array>
#include <chrono>
#include <csignal>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(launch)

namespace {

/// What `take_signals` makes of the signals of this process, until the end of a test.
class TakenSignals
{
public:
    TakenSignals()
    {
        for (std::size_t i = 0; i < numbers.size(); ++i)
            ::sigaction(numbers.at(i), nullptr, &before_.at(i));
        site::take_signals();
    }
    TakenSignals(TakenSignals const&) = delete;
    TakenSignals& operator=(TakenSignals const&) = delete;
    ~TakenSignals()
    {
        for (std::size_t i = 0; i < numbers.size(); ++i)
            ::sigaction(numbers.at(i), &before_.at(i), nullptr);
    }

private:
    static constexpr std::array numbers{SIGINT, SIGTERM, SIGHUP, SIGPIPE, SIGCHLD};
    std::array<struct sigaction, numbers.size()> before_{};
};

/// How a child ended; -1: it has not within ten seconds, and is killed.
int end_of(pid_t child)
{
    int status = 0;
    for (auto const until = std::chrono::steady_clock::now() + 10s;
         std::chrono::steady_clock::now() < until;) {
        if (::waitpid(child, &status, WNOHANG) == child)
            return status;
        std::this_thread::yield();
    }
    ::kill(child, SIGKILL);
    ::waitpid(child, &status, 0);
    return -1;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_server_that_is_told_to_end_while_it_is_being_started_ends)
{
    TakenSignals const signals;
    for (int i = 0; i < 100; ++i) {
        auto const child = site::start_detached({"/bin/sleep", "100"}, ::dup(STDERR_FILENO));
        BOOST_TEST_REQUIRE(child.has_value());
        ::kill(*child, SIGTERM);
        auto const status = end_of(*child);
        BOOST_TEST_REQUIRE((WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM), "attempt " << i);
    }
}

BOOST_AUTO_TEST_SUITE_END()
