// How long a GET waits when requests come at a fixed rate, whether or not earlier ones have been answered (an
// open loop: a server that pauses is asked all the same, and each of those requests counts with the time it
// should have begun).
//
//     speed_probe PORT PATH REQUESTS_PER_SECOND SECONDS
//
// Prints "requests N lost N median_us N p99_us N longest_us N". Connections are opened before the clock
// starts.
#include "sockets.hpp"

#include <algorithm>
#include <sched.h>

using namespace speed;

namespace {

constexpr int connections = 20;

class Probe
{
public:
    Probe(int port, std::string const& path)
        : request_("GET " + path + " HTTP/1.1\r\nHost: localhost\r\n\r\n")
    {
        for (int i = 0; i < connections; ++i) {
            int const connection = connect_to(INADDR_LOOPBACK, port);
            poller_.watch(connection);
            idle_.push_back(connection);
        }
        usleep(100'000);
    }

    void run(int rate, int seconds)
    {
        std::int64_t const step = 1'000'000'000 / rate;
        auto const begin = nanoseconds();
        std::int64_t const total = static_cast<std::int64_t>(rate) * seconds;
        std::int64_t due = 0;
        auto const end = begin + total * step + 10'000'000'000; // ten more seconds for answers that are late
        while (static_cast<std::int64_t>(waits_.size()) < total && nanoseconds() < end) {
            for (; due < total && !idle_.empty() && nanoseconds() >= begin + due * step; ++due)
                ask(begin + due * step);
            auto const rest = begin + due * step - nanoseconds();
            receive(due < total && !idle_.empty()
                        ? static_cast<int>(std::max<std::int64_t>(rest, 0) / 1'000'000)
                        : 10);
        }
        report(total);
    }

private:
    void ask(std::int64_t since)
    {
        int const connection = idle_.back();
        idle_.pop_back();
        if (static_cast<std::size_t>(connection) >= asked_.size())
            asked_.resize(static_cast<std::size_t>(connection) + 1);
        asked_[static_cast<std::size_t>(connection)] = since;
        send_text(connection, request_);
    }

    void receive(int milliseconds)
    {
        for (int const connection : poller_.wait(milliseconds)) {
            char text[8192];
            if (read(connection, text, sizeof text) <= 0) {
                close(connection);
                std::erase(idle_, connection); // the server closes those that are not needed for long
                continue;
            }
            waits_.push_back(nanoseconds() - asked_[static_cast<std::size_t>(connection)]);
            idle_.push_back(connection);
        }
    }

    void report(std::int64_t total)
    {
        std::sort(waits_.begin(), waits_.end());
        auto const at = [&](double share) {
            return waits_.empty()
                       ? -1
                       : waits_[static_cast<std::size_t>(share * static_cast<double>(waits_.size() - 1))] /
                             1000;
        };
        std::printf("requests %lld lost %lld median_us %lld p99_us %lld longest_us %lld\n",
                    static_cast<long long>(total),
                    static_cast<long long>(total) - static_cast<long long>(waits_.size()),
                    static_cast<long long>(at(0.5)), static_cast<long long>(at(0.99)),
                    static_cast<long long>(at(1)));
    }

    Poller poller_;
    std::string request_;
    std::vector<int> idle_;
    std::vector<std::int64_t> asked_, waits_;
};

} // namespace

int main(int argc, char** argv)
{
    if (argc != 5) {
        std::fputs("usage: speed_probe PORT PATH REQUESTS_PER_SECOND SECONDS\n", stderr);
        return 2;
    }
    prepare_process();
    // Its own waiting for a core is not the server's. Without the right to this it counts as well.
    sched_param const first{.sched_priority = 1};
    sched_setscheduler(0, SCHED_FIFO, &first);
    Probe(std::atoi(argv[1]), argv[2]).run(std::atoi(argv[3]), std::atoi(argv[4]));
}
