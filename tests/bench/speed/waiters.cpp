// Browsers in the waiting room of a session server, whose machines are full: N WebSockets on /client that
// have asked for a simulation.
//
//     speed_waiters PORT N
//
// Prints "connected SECONDS" when each knows how many are ahead of it. A line on standard input has the first
// one leave: "left NANOSECONDS" (monotonic) when its connection was closed, and "all NANOSECONDS" when each
// of those behind it has heard that one less is ahead. Ends with its standard input.
#include "sockets.hpp"

#include <algorithm>
#include <charconv>

using namespace speed;

namespace {

constexpr int together = 64; ///< Handshakes under way at a time.

/// A frame of a browser; a mask of zeros changes nothing.
std::string masked_text(std::string_view text)
{
    std::string frame("\x81\xFE", 2);
    frame.push_back(static_cast<char>(text.size() >> 8));
    frame.push_back(static_cast<char>(text.size() & 0xFF));
    return frame.append(4, '\0').append(text);
}

std::string const start = masked_text(
    R"({"start":{"url":"https://github.com/cyberbotics/webots/blob/R2025a/projects/languages/python/worlds/example.wbt","mode":"mjpeg"}})");

struct Waiter
{
    enum class State
    {
        connecting,
        shaking_hands,
        waiting
    };

    State state = State::connecting;
    int number = 0;    ///< In the order of the connections.
    int ahead = -1;    ///< How many it believes to be; -1: it has not heard of any.
    std::string bytes; ///< Of a frame that has not come as a whole.
};

class Waiters
{
public:
    Waiters(int port, int count) : port_(port), count_(count) { poller_.watch(STDIN_FILENO); }

    void run()
    {
        begin_ = nanoseconds();
        while (opened_ < together && opened_ < count_)
            open();
        for (;;)
            for (int const descriptor : poller_.wait()) {
                if (descriptor == STDIN_FILENO) {
                    char line[64];
                    if (read(STDIN_FILENO, line, sizeof line) <= 0)
                        return;
                    let_first_leave();
                } else {
                    receive(descriptor);
                }
            }
    }

private:
    Waiter& waiter(int connection) { return waiters_[static_cast<std::size_t>(connection)]; }

    void open()
    {
        int const connection = connect_to(INADDR_LOOPBACK, port_);
        if (static_cast<std::size_t>(connection) >= waiters_.size())
            waiters_.resize(static_cast<std::size_t>(connection) + 1024);
        waiter(connection) = Waiter();
        waiter(connection).number = opened_++;
        poller_.watch(connection, EPOLLOUT);
    }

    /// Each browser has an address of its own, as a proxy would say it.
    void shake_hands(int connection)
    {
        int const number = waiter(connection).number;
        send_text(connection,
                  "GET /client HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                  "X-Forwarded-For: 10.0." +
                      std::to_string(number >> 8) + "." + std::to_string(number & 0xFF) +
                      "\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n");
        poller_.watch(connection, EPOLLIN, EPOLL_CTL_MOD);
        waiter(connection).state = Waiter::State::shaking_hands;
    }

    void receive(int connection)
    {
        auto& one = waiter(connection);
        if (one.state == Waiter::State::connecting)
            return shake_hands(connection);
        char text[4096];
        ssize_t const size = read(connection, text, sizeof text);
        if (size <= 0)
            fail("a browser lost its socket", one.bytes);
        one.bytes.append(text, static_cast<std::size_t>(size));
        if (one.state == Waiter::State::shaking_hands) {
            auto const end = one.bytes.find("\r\n\r\n");
            if (!one.bytes.starts_with("HTTP/1.1 101") || end == one.bytes.npos)
                fail("no handshake", one.bytes);
            one.bytes.erase(0, end + 4);
            one.state = Waiter::State::waiting;
            send_text(connection, start);
            if (opened_ < count_)
                open(); // which may move `one`
        }
        take_frames(connection);
    }

    /// Frames of a server are not masked, and those here shorter than 64 KiB.
    void take_frames(int connection)
    {
        auto& one = waiter(connection);
        std::string_view rest = one.bytes;
        for (;;) {
            std::size_t const length = rest.size() < 2 ? 0 : rest[1] & 0x7F;
            std::size_t const header = length == 126 ? 4 : 2;
            if (rest.size() < header)
                break;
            auto const byte = [&](std::size_t i) { return static_cast<std::size_t>(rest[i]) & 0xFF; };
            std::size_t const size = length == 126 ? byte(2) << 8 | byte(3) : length;
            if (rest.size() < header + size)
                break;
            if ((rest[0] & 0x0F) == 1)
                take_text(connection, rest.substr(header, size));
            rest.remove_prefix(header + size);
        }
        one.bytes.erase(0, one.bytes.size() - rest.size());
    }

    void take_text(int connection, std::string_view text)
    {
        constexpr std::string_view queue = "queue:";
        if (text.starts_with("loading: Error"))
            fail("a browser was refused", text);
        if (!text.starts_with(queue))
            return;
        auto& one = waiter(connection);
        int ahead = 0;
        std::from_chars(text.data() + queue.size(), text.data() + text.size(), ahead);
        if (one.ahead < 0 && ++placed_ == count_)
            std::printf("connected %.6f\n", static_cast<double>(nanoseconds() - begin_) / 1e9);
        if (left_ > 0 && one.ahead == ahead + 1 && ++told_ == count_ - left_)
            std::printf("all %lld\n", static_cast<long long>(nanoseconds()));
        one.ahead = ahead;
        if (ahead == 0)
            first_ = connection;
    }

    void let_first_leave()
    {
        ++left_;
        told_ = 0;
        send_text(first_, std::string_view("\x88\x80\0\0\0\0", 6)); // a close frame
        poller_.watch(first_, 0, EPOLL_CTL_DEL);
        close(first_);
        std::printf("left %lld\n", static_cast<long long>(nanoseconds()));
    }

    [[noreturn]] static void fail(char const* what, std::string_view said)
    {
        std::fprintf(stderr, "%s: %.*s\n", what, static_cast<int>(said.size()), said.data());
        std::exit(1);
    }

    Poller poller_;
    int port_, count_, opened_ = 0;
    std::int64_t begin_ = 0;
    int placed_ = 0;              ///< Who knows how many are ahead.
    int left_ = 0;                ///< Who has left.
    int told_ = 0;                ///< Who knows of the last of these.
    int first_ = -1;              ///< The connection of the one with nobody ahead.
    std::vector<Waiter> waiters_; ///< By connection.
};

} // namespace

int main(int argc, char** argv)
{
    if (argc != 3) {
        std::fputs("usage: speed_waiters PORT N\n", stderr);
        return 2;
    }
    prepare_process();
    Waiters(std::atoi(argv[1]), std::atoi(argv[2])).run();
}
