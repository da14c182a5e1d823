// Thousands of simulation servers as far as a session server sees them: one process that answers GET /load on
// every address of the loopback.
//
//     speed_machines PORT
//
// Lines on standard input, each answered by a line on standard output:
//     load VALUE        from now on; "answered NANOSECONDS" (monotonic) when the first poll after it got the
//     value closing on|off    close the connection after each answer; "ok" hang NUMBER       the machine with
//     this number (from 0) accepts and never answers; "ok" polls             "polls COUNT" answered since the
//     start
#include "sockets.hpp"

using namespace speed;

namespace {

class Machines
{
public:
    explicit Machines(int port) : listener_(listen_on(port))
    {
        poller_.watch(listener_);
        poller_.watch(STDIN_FILENO);
    }

    void run()
    {
        for (;;)
            for (int const descriptor : poller_.wait()) {
                if (descriptor == listener_)
                    accept_all();
                else if (descriptor != STDIN_FILENO)
                    answer(descriptor);
                else if (!obey())
                    return;
            }
    }

private:
    void accept_all()
    {
        for (int connection; (connection = accept_from(listener_)) >= 0;)
            poller_.watch(connection);
    }

    void answer(int connection)
    {
        char request[4096];
        ssize_t const size = read(connection, request, sizeof request);
        if (size <= 0) {
            close(connection);
            return;
        }
        if (number_of(connection) == hanging_)
            return;
        std::string text = "HTTP/1.1 200 OK\r\nContent-Type: text/html; charset=UTF-8\r\nContent-Length: ";
        text +=
            std::to_string(load_.size()) + (closing_ ? "\r\nConnection: close\r\n\r\n" : "\r\n\r\n") + load_;
        send_text(connection, text);
        ++polls_;
        if (closing_)
            close(connection);
        if (announce_)
            std::printf("answered %lld\n", static_cast<long long>(nanoseconds()));
        announce_ = false;
    }

    static int number_of(int connection)
    {
        sockaddr_in address{};
        socklen_t size = sizeof address;
        getsockname(connection, reinterpret_cast<sockaddr*>(&address), &size);
        return static_cast<int>(ntohl(address.sin_addr.s_addr) - machine_address(0));
    }

    bool obey()
    {
        char text[256];
        ssize_t const size = read(STDIN_FILENO, text, sizeof text);
        if (size <= 0)
            return false;
        std::string line(text, static_cast<std::size_t>(size));
        line.resize(line.find_last_not_of('\n') + 1);
        auto const argument = line.substr(line.find(' ') + 1);
        if (line.starts_with("load ")) {
            load_ = argument;
            announce_ = true;
            return true;
        }
        if (line == "polls") {
            std::printf("polls %lld\n", polls_);
            return true;
        }
        if (line.starts_with("closing "))
            closing_ = argument == "on";
        else if (line.starts_with("hang "))
            hanging_ = std::atoi(argument.c_str());
        std::puts("ok");
        return true;
    }

    Poller poller_;
    int listener_;
    std::string load_ = "10.0";
    long long polls_ = 0;
    int hanging_ = -1;
    bool closing_ = false, announce_ = false;
};

} // namespace

int main(int argc, char** argv)
{
    if (argc != 2) {
        std::fputs("usage: speed_machines PORT\n", stderr);
        return 2;
    }
    prepare_process();
    Machines(std::atoi(argv[1])).run();
}
