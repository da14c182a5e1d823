// The least that a server can do: the same work as ours by the bare system calls, without a protocol's rules,
// limits or deadlines.
//
//     speed_floor http PORT             answers every GET alike
//     speed_floor websocket PORT        accepts WebSockets; a line on standard input sends a frame to each
//     and prints "sent NANOSECONDS",
//                                       the monotonic time at which it began
//     speed_floor poll PORT N ROUNDS kept|closing
//                                       asks N machines ROUNDS times, prints "cpu_us_per_poll X"
#include "sockets.hpp"

using namespace speed;

namespace {

void serve_http(int port)
{
    constexpr std::string_view answer =
        "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=UTF-8\r\nContent-Length: 19\r\n\r\n"
        "ws://localhost:2000";
    Poller poller;
    int const listener = listen_on(port);
    poller.watch(listener);
    for (;;)
        for (int const ready : poller.wait()) {
            if (ready == listener) {
                for (int connection; (connection = accept_from(listener)) >= 0;)
                    poller.watch(connection);
                continue;
            }
            char request[4096];
            if (read(ready, request, sizeof request) > 0)
                send_text(ready, answer);
            else
                close(ready);
        }
}

void serve_websockets(int port)
{
    // The answer to the one key that speed_browsers sends.
    constexpr std::string_view handshake =
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Accept: ICX+Yqv66kxgM0FcWaLWlFLwTAI=\r\n\r\n\x81\x01";
    Poller poller;
    int const listener = listen_on(port);
    poller.watch(listener);
    poller.watch(STDIN_FILENO);
    std::vector<int> browsers;
    char value = '1';
    for (;;)
        for (int const ready : poller.wait()) {
            char bytes[4096];
            if (ready == listener) {
                for (int connection; (connection = accept_from(listener)) >= 0;)
                    poller.watch(connection);
            } else if (ssize_t const size = read(ready, bytes, sizeof bytes); ready == STDIN_FILENO) {
                if (size <= 0)
                    return;
                std::printf("sent %lld\n", static_cast<long long>(nanoseconds()));
                value = value == '1' ? '0' : '1';
                for (int const browser : browsers)
                    send_text(browser, std::string("\x81\x01") + value);
            } else if (size <= 0) {
                close(ready);
                std::erase(browsers, ready);
            } else {
                send_text(ready, std::string(handshake) + value);
                browsers.push_back(ready);
            }
        }
}

void poll_machines(int port, int count, int rounds, bool closing)
{
    Poller poller;
    std::vector<int> kept;
    auto const cpu = nanoseconds(CLOCK_PROCESS_CPUTIME_ID);
    for (int round = 0; round < rounds; ++round) {
        for (int number = 0; number < count; ++number)
            if (closing || round == 0) {
                kept.push_back(connect_to(machine_address(number), port));
                poller.watch(kept.back(), EPOLLOUT);
            } else {
                send_text(kept[static_cast<std::size_t>(number)],
                          "GET /load HTTP/1.1\r\nHost: localhost\r\n\r\n");
            }
        std::vector<bool> asked(static_cast<std::size_t>(kept.back()) + 1, !closing && round > 0);
        for (int answered = 0; answered < count;)
            for (int const ready : poller.wait()) {
                if (!asked[static_cast<std::size_t>(ready)]) {
                    asked[static_cast<std::size_t>(ready)] = true;
                    send_text(ready, "GET /load HTTP/1.1\r\nHost: localhost\r\n\r\n");
                    poller.watch(ready, EPOLLIN, EPOLL_CTL_MOD);
                    continue;
                }
                char answer[4096];
                ssize_t const size = read(ready, answer, sizeof answer);
                answered += size > 0;
                if (closing && size > 0)
                    close(ready);
            }
        if (closing)
            kept.clear();
    }
    std::printf("cpu_us_per_poll %.2f\n", static_cast<double>(nanoseconds(CLOCK_PROCESS_CPUTIME_ID) - cpu) /
                                              1e3 / (static_cast<double>(count) * rounds));
}

} // namespace

int main(int argc, char** argv)
{
    prepare_process();
    std::string const what = argc > 1 ? argv[1] : "";
    if (what == "http" && argc == 3)
        serve_http(std::atoi(argv[2]));
    else if (what == "websocket" && argc == 3)
        serve_websockets(std::atoi(argv[2]));
    else if (what == "poll" && argc == 6)
        poll_machines(std::atoi(argv[2]), std::atoi(argv[3]), std::atoi(argv[4]),
                      std::string_view(argv[5]) == "closing");
    else {
        std::fputs("usage: speed_floor http PORT | websocket PORT | poll PORT N ROUNDS kept|closing\n",
                   stderr);
        return 2;
    }
}
