// A simulator that is ready at once and costs nothing: what is measured around it is the server's.
//
//     webots [--port=N] ...         as webots-simulation-server starts it
//
// Listens on the port, writes the ready line, and waits for a signal. Every connection is closed.
#include "sockets.hpp"

int main(int argc, char** argv)
{
    int port = 1234;
    for (int i = 1; i < argc; ++i)
        if (std::string_view(argv[i]).starts_with("--port="))
            port = std::atoi(argv[i] + 7);
    int const listener = speed::listen_on(port);
    std::puts(".");
    std::fflush(stdout);
    speed::Poller poller;
    poller.watch(listener);
    for (;;)
        for (int const ready : poller.wait())
            close(speed::accept_from(ready));
}
