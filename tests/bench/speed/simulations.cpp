// Stands in for any number of simulators that browsers watch: what a gateway's other side is in the
// benchmark.
//
//     speed_simulations PORT
//
// A WebSocket on "/flood" is sent messages of 64 kB as fast as it takes them; on "/pictures?SIZE,PERIOD" a
// message of SIZE bytes every PERIOD microseconds, each beginning with the monotonic time in nanoseconds at
// which it is sent; on any other path nothing. "GET /file?SIZE" is answered with a file, and the connection
// closed.
#include "sockets.hpp"

#include <algorithm>
#include <memory>
#include <queue>
#include <sys/prctl.h>
#include <unordered_map>

using namespace speed;

namespace {

constexpr std::size_t flood_size = 64 * 1024;

/// The beginning of a WebSocket message of that size.
std::string frame_head(std::size_t size)
{
    std::string head("\x82");
    int const width = size < 126 ? 0 : size < 65536 ? 2 : 8;
    head += static_cast<char>(width == 0 ? size : width == 2 ? 126 : 127);
    for (int byte = width - 1; byte >= 0; --byte)
        head += static_cast<char>(size >> (8 * byte) & 0xff);
    return head;
}

struct Browser
{
    std::string request;
    std::string unsent; ///< Its rest is to be sent before anything else.
    std::size_t sent = 0;
    std::size_t left = 0; ///< Of a file.
    std::size_t picture = 0;
    std::int64_t period = 0;
    bool floods = false;
    bool closes = false;
    bool answered = false;
};

class Simulations
{
public:
    explicit Simulations(int port) : listener_(listen_on(port)), block_(frame_head(flood_size))
    {
        block_.append(flood_size, 'x');
        poller_.watch(listener_);
    }

    void run()
    {
        for (;;) {
            for (int const ready :
                 pictures_.empty() ? poller_.wait() : poller_.wait_until(pictures_.top().first))
                if (ready == listener_)
                    accept();
                else
                    serve(ready);
            send_pictures();
        }
    }

private:
    using Due = std::pair<std::int64_t, int>;

    void accept()
    {
        for (int connection; (connection = accept_from(listener_)) >= 0;) {
            browsers_.insert_or_assign(connection, Browser());
            poller_.watch(connection);
        }
    }

    void close_connection(int connection)
    {
        browsers_.erase(connection);
        close(connection);
    }

    void serve(int connection)
    {
        auto const found = browsers_.find(connection);
        if (found == browsers_.end())
            return;
        auto& browser = found->second;
        char bytes[16 * 1024];
        auto const size = recv(connection, bytes, sizeof bytes, MSG_DONTWAIT);
        if (size == 0 || (size < 0 && errno != EAGAIN))
            return close_connection(connection);
        if (size > 0 && !browser.answered)
            take(connection, browser, std::string_view(bytes, static_cast<std::size_t>(size)));
        if (browser.answered && !send_on(connection, browser))
            close_connection(connection);
    }

    void take(int connection, Browser& browser, std::string_view bytes)
    {
        browser.request.append(bytes);
        if (browser.request.find("\r\n\r\n") == std::string::npos)
            return;
        auto const target = browser.request.substr(4, browser.request.find(' ', 4) - 4);
        auto const query = target.substr(std::min(target.size(), target.find('?') + 1));
        browser.answered = true;
        if (target.starts_with("/file")) {
            browser.left = std::strtoull(query.c_str(), nullptr, 10);
            browser.unsent = "HTTP/1.1 200 OK\r\nContent-Type: application/octet-stream\r\n"
                             "Connection: close\r\nContent-Length: " +
                             std::to_string(browser.left) + "\r\n\r\n";
            browser.closes = true;
        } else {
            // The answer to the one key that the viewers send.
            browser.unsent =
                "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                "Sec-WebSocket-Accept: ICX+Yqv66kxgM0FcWaLWlFLwTAI=\r\n\r\n";
            browser.floods = target.starts_with("/flood");
            if (target.starts_with("/pictures")) {
                browser.picture = std::strtoull(query.c_str(), nullptr, 10);
                browser.period = 1000 * std::atoll(query.substr(query.find(',') + 1).c_str());
                pictures_.emplace(first_picture(connection, browser.period), connection);
            }
        }
        browser.request = std::string();
        if (browser.floods || browser.left > 0)
            poller_.watch(connection, EPOLLIN | EPOLLOUT, EPOLL_CTL_MOD);
    }

    /// Each at a moment of its own, since what viewers watch has nothing in common; but each crowd of viewers
    /// at the same moments, however long it took them to connect: else some would by chance be sent more
    /// pictures together than others.
    static std::int64_t first_picture(int connection, std::int64_t period)
    {
        constexpr std::uint64_t odd = 0x9e3779b97f4a7c15; // from SplitMix64, as the mixing step
        std::uint64_t phase = static_cast<std::uint64_t>(connection) * odd;
        phase = (phase ^ (phase >> 30)) * 0xbf58476d1ce4e5b9;
        phase = (phase ^ (phase >> 27)) * 0x94d049bb133111eb;
        phase = (phase ^ (phase >> 31)) % static_cast<std::uint64_t>(period);
        return (nanoseconds() / period + 1) * period + static_cast<std::int64_t>(phase);
    }

    /// False when the connection is to be closed.
    bool send_on(int connection, Browser& browser)
    {
        for (int blocks = 0; blocks < 4; ++blocks) {
            if (browser.sent == browser.unsent.size()) {
                browser.sent = 0;
                if (browser.floods)
                    browser.unsent = block_;
                else if (browser.left > 0) {
                    browser.unsent.assign(std::min(browser.left, flood_size), 'y');
                    browser.left -= browser.unsent.size();
                } else {
                    browser.unsent = std::string();
                    return !browser.closes;
                }
            }
            auto const size = ::send(connection, browser.unsent.data() + browser.sent,
                                     browser.unsent.size() - browser.sent, MSG_NOSIGNAL | MSG_DONTWAIT);
            if (size < 0)
                return errno == EAGAIN;
            browser.sent += static_cast<std::size_t>(size);
        }
        return true;
    }

    void send_pictures()
    {
        while (!pictures_.empty() && pictures_.top().first <= nanoseconds()) {
            auto const [when, connection] = pictures_.top();
            pictures_.pop();
            auto const found = browsers_.find(connection);
            if (found == browsers_.end() || found->second.picture == 0)
                continue;
            auto& browser = found->second;
            pictures_.emplace(when + browser.period, connection);
            if (browser.sent < browser.unsent.size() && browser.sent > 0)
                continue; // a simulator leaves out what is not taken in time
            browser.unsent += frame_head(browser.picture);
            auto const now = nanoseconds();
            browser.unsent.append(reinterpret_cast<char const*>(&now), sizeof now);
            browser.unsent.append(browser.picture - sizeof now, 'p');
            if (!send_on(connection, browser))
                close_connection(connection);
        }
    }

    Poller poller_;
    int listener_;
    std::string block_;
    std::unordered_map<int, Browser> browsers_;
    std::priority_queue<Due, std::vector<Due>, std::greater<>> pictures_;
};

} // namespace

int main(int argc, char** argv)
{
    if (argc != 2)
        return 2;
    prepare_process();
    prctl(PR_SET_TIMERSLACK, 1); // nanoseconds: pictures are sent when they are due
    Simulations(std::atoi(argv[1])).run();
}
