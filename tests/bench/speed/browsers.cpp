// Browsers on an availability socket: connects N WebSockets, then tells when the last of them got what.
//
//     speed_browsers PORT N
//
// Prints "connected SECONDS" when each has its first frame, and then "all NANOSECONDS" (monotonic) whenever
// each has got one more. Ends with its standard input.
#include "sockets.hpp"

#include <algorithm>

using namespace speed;

namespace {

constexpr int together = 64; ///< Handshakes under way at a time.

class Browsers
{
public:
    Browsers(int port, int count) : port_(port), count_(count) { poller_.watch(STDIN_FILENO); }

    void run()
    {
        auto const begin = nanoseconds();
        while (opened_ < together && opened_ < count_)
            open();
        for (long long rounds = 0;;) {
            for (int const descriptor : poller_.wait()) {
                if (descriptor == STDIN_FILENO)
                    return;
                receive(descriptor);
                if (frames_ < (rounds + 1) * count_)
                    continue;
                if (++rounds == 1)
                    std::printf("connected %.6f\n", static_cast<double>(nanoseconds() - begin) / 1e9);
                else
                    std::printf("all %lld\n", static_cast<long long>(nanoseconds()));
            }
        }
    }

private:
    enum class State
    {
        connecting,
        shaking_hands,
        open
    };

    void open()
    {
        int const connection = connect_to(INADDR_LOOPBACK, port_);
        if (static_cast<std::size_t>(connection) >= states_.size())
            states_.resize(static_cast<std::size_t>(connection) + 1024);
        states_[static_cast<std::size_t>(connection)] = State::connecting;
        poller_.watch(connection, EPOLLOUT);
        ++opened_;
    }

    void receive(int connection)
    {
        auto& state = states_[static_cast<std::size_t>(connection)];
        if (state == State::connecting) {
            send_text(connection,
                      "GET / HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                      "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n");
            poller_.watch(connection, EPOLLIN, EPOLL_CTL_MOD);
            state = State::shaking_hands;
            return;
        }
        char text[2048];
        ssize_t const size = read(connection, text, sizeof text);
        if (size <= 0) {
            std::fprintf(stderr, "a browser lost its socket after %lld frames\n", frames_);
            std::exit(1);
        }
        std::string_view rest(text, static_cast<std::size_t>(size));
        if (state == State::shaking_hands) {
            auto const end = rest.find("\r\n\r\n");
            if (!rest.starts_with("HTTP/1.1 101") || end == rest.npos) {
                std::fprintf(stderr, "no handshake: %.*s\n", static_cast<int>(size), text);
                std::exit(1);
            }
            rest.remove_prefix(end + 4);
            state = State::open;
            if (opened_ < count_)
                open();
        }
        count_frames(rest);
    }

    /// Frames of a server are unmasked, and those here short; a ping counts for nothing.
    void count_frames(std::string_view bytes)
    {
        while (bytes.size() >= 2) {
            if ((bytes[0] & 0x0F) == 1)
                ++frames_;
            bytes.remove_prefix(std::min<std::size_t>(bytes.size(), 2 + (bytes[1] & 0x7F)));
        }
    }

    Poller poller_;
    int port_, count_, opened_ = 0;
    long long frames_ = 0;
    std::vector<State> states_;
};

} // namespace

int main(int argc, char** argv)
{
    if (argc != 3) {
        std::fputs("usage: speed_browsers PORT N\n", stderr);
        return 2;
    }
    prepare_process();
    Browsers(std::atoi(argv[1]), std::atoi(argv[2])).run();
}
