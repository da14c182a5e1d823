// Browsers that watch simulations (speed_simulations), directly or through a gateway.
//
//     speed_viewers PORT N TARGET plain|tls
//
// Connects N WebSockets to TARGET, or for "/file..." requests it again and again on as many connections, and
// prints "connected". Then each line on standard input is an order: "begin" forgets what was counted, "end"
// prints "bytes BYTES messages N median_us X p99_us X"; "stall" reads no more. Ends with its standard input.
#include "sockets.hpp"

#include <openssl/ssl.h>

#include <algorithm>
#include <fcntl.h>
#include <unordered_map>

using namespace speed;

namespace {

constexpr int buffer_size = 256 * 1024;

struct Viewer
{
    SSL* tls = nullptr;
    std::string head;       ///< Of a message, or of an answer, and the first bytes of what follows.
    std::uint64_t left = 0; ///< Of the message.
    std::int64_t sent = 0;
};

class Viewers
{
public:
    Viewers(int port, int count, std::string target, bool tls)
        : port_(port), target_(std::move(target)), is_file_(target_.starts_with("/file")),
          buffer_(buffer_size)
    {
        if (tls) {
            context_ = SSL_CTX_new(TLS_client_method());
            SSL_CTX_set_verify(context_, SSL_VERIFY_NONE, nullptr);
        }
        for (int i = 0; i < count; ++i)
            open();
        poller_.watch(STDIN_FILENO);
    }

    void run()
    {
        std::puts("connected");
        for (;;)
            for (int const ready : poller_.wait()) {
                if (ready != STDIN_FILENO)
                    receive(ready);
                else if (!obey())
                    return;
            }
    }

private:
    void open()
    {
        int const connection = checked(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0), "socket");
        auto const address = address_of(INADDR_LOOPBACK, port_);
        checked(connect(connection, reinterpret_cast<sockaddr const*>(&address), sizeof address), "connect");
        int const on = 1;
        setsockopt(connection, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
        auto& viewer = viewers_[connection];
        if (context_) {
            viewer.tls = SSL_new(context_);
            SSL_set_fd(viewer.tls, connection);
            checked(SSL_connect(viewer.tls) == 1 ? 0 : -1, "SSL_connect");
        }
        request(connection, viewer);
        if (!is_file_) {
            std::string head;
            char byte = 0;
            while (!head.ends_with("\r\n\r\n") && read(connection, viewer, &byte, 1) == 1)
                head += byte;
            if (!head.starts_with("HTTP/1.1 101")) {
                std::fprintf(stderr, "no WebSocket: %s\n", head.c_str());
                std::exit(1);
            }
        }
        fcntl(connection, F_SETFL, fcntl(connection, F_GETFL) | O_NONBLOCK);
        poller_.watch(connection);
    }

    void request(int connection, Viewer& viewer)
    {
        std::string const head = "GET " + target_ + " HTTP/1.1\r\nHost: localhost\r\n" +
                                 (is_file_ ? "\r\n"
                                           : "Upgrade: websocket\r\nConnection: Upgrade\r\n"
                                             "Sec-WebSocket-Version: 13\r\n"
                                             "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n");
        if (viewer.tls)
            checked(SSL_write(viewer.tls, head.data(), static_cast<int>(head.size())), "SSL_write");
        else
            send_text(connection, head);
    }

    static int read(int connection, Viewer& viewer, char* to, int size)
    {
        return viewer.tls ? SSL_read(viewer.tls, to, size)
                          : static_cast<int>(recv(connection, to, static_cast<std::size_t>(size), 0));
    }

    void receive(int connection)
    {
        auto& viewer = viewers_[connection];
        for (int records = 0; records < 16; ++records) { // of TLS, which may lie in the library
            int const size = read(connection, viewer, buffer_.data(), buffer_size);
            if (size < 0)
                return;
            if (size == 0) {
                std::fprintf(stderr, "a connection has ended\n");
                std::exit(1);
            }
            bytes_ += static_cast<std::uint64_t>(size);
            take(connection, viewer, std::string_view(buffer_.data(), static_cast<std::size_t>(size)));
            if (!viewer.tls)
                return;
        }
    }

    void take(int connection, Viewer& viewer, std::string_view bytes)
    {
        while (!bytes.empty()) {
            if (viewer.left == 0) {
                auto const before = viewer.head.size();
                viewer.head.append(bytes.substr(0, 1024));
                auto const size = is_file_ ? begin_file(viewer) : begin_message(viewer);
                if (size == 0)
                    return;
                bytes.remove_prefix(size - before);
                viewer.head.clear();
            }
            auto const part = std::min<std::uint64_t>(viewer.left, bytes.size());
            viewer.left -= part;
            bytes.remove_prefix(static_cast<std::size_t>(part));
            if (viewer.left > 0)
                return;
            ++messages_;
            if (is_file_)
                request(connection, viewer);
            else
                delays_.push_back(nanoseconds() - viewer.sent);
        }
    }

    /// The size of the head; 0: it is not complete.
    static std::size_t begin_file(Viewer& viewer)
    {
        auto const end = viewer.head.find("\r\n\r\n");
        if (end == std::string::npos)
            return 0;
        auto const at = viewer.head.find("ontent-");
        auto length = std::string::npos;
        for (auto found = at; found != std::string::npos; found = viewer.head.find("ontent-", found + 1))
            if (viewer.head.compare(found + 8, 5, "ength") == 0)
                length = found + 15;
        if (length == std::string::npos) {
            std::fprintf(stderr, "no length: %s\n", viewer.head.c_str());
            std::exit(1);
        }
        viewer.left = std::strtoull(viewer.head.c_str() + length, nullptr, 10);
        return end + 4;
    }

    static std::size_t begin_message(Viewer& viewer)
    {
        if (viewer.head.size() < 2)
            return 0;
        auto const byte = [&](std::size_t i) { return static_cast<unsigned char>(viewer.head[i]); };
        std::size_t const width = byte(1) < 126 ? 0 : byte(1) == 126 ? 2 : 8;
        auto const head = 2 + width;
        if (viewer.head.size() < head + sizeof viewer.sent)
            return 0;
        std::uint64_t size = width == 0 ? byte(1) : 0;
        for (std::size_t i = 0; i < width; ++i)
            size = size << 8 | byte(2 + i);
        std::memcpy(&viewer.sent, viewer.head.data() + head, sizeof viewer.sent);
        viewer.left = size;
        return head;
    }

    bool obey()
    {
        char line[64];
        auto const size = ::read(STDIN_FILENO, line, sizeof line);
        if (size <= 0)
            return false;
        std::string_view const order(line, static_cast<std::size_t>(size));
        if (order.starts_with("begin")) {
            bytes_ = messages_ = 0;
            delays_.clear();
            std::puts("ok");
        } else if (order.starts_with("end")) {
            std::sort(delays_.begin(), delays_.end());
            auto const at = [this](double share) {
                return delays_.empty() ? 0.0
                                       : static_cast<double>(delays_[static_cast<std::size_t>(
                                             share * static_cast<double>(delays_.size() - 1))]) /
                                             1e3;
            };
            std::printf("bytes %llu messages %llu median_us %.1f p99_us %.1f\n",
                        static_cast<unsigned long long>(bytes_), static_cast<unsigned long long>(messages_),
                        at(0.5), at(0.99));
        } else if (order.starts_with("stall")) {
            for (auto const& [connection, viewer] : viewers_)
                poller_.watch(connection, 0, EPOLL_CTL_MOD);
            std::puts("ok");
        }
        return true;
    }

    int port_;
    std::string target_;
    bool is_file_;
    std::vector<char> buffer_;
    SSL_CTX* context_ = nullptr;
    Poller poller_;
    std::unordered_map<int, Viewer> viewers_;
    std::uint64_t bytes_ = 0;
    std::uint64_t messages_ = 0;
    std::vector<std::int64_t> delays_;
};

} // namespace

int main(int argc, char** argv)
{
    if (argc != 5)
        return 2;
    prepare_process();
    Viewers(std::atoi(argv[1]), std::atoi(argv[2]), argv[3], argv[4] == std::string_view("tls")).run();
}
