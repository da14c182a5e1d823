#include "console.hpp"

#include <cerrno>
#include <string>

#include <poll.h>
#include <unistd.h>

namespace webots_cloud::demo {

void print_bytes(std::string_view bytes)
{
    while (!bytes.empty()) {
        ssize_t const written = ::write(STDOUT_FILENO, bytes.data(), bytes.size());
        if (written >= 0) {
            bytes.remove_prefix(static_cast<std::size_t>(written));
        } else if (errno == EAGAIN) {
            pollfd writable{STDOUT_FILENO, POLLOUT, 0};
            ::poll(&writable, 1, -1);
        } else if (errno != EINTR) {
            return;
        }
    }
}

void print_line(std::string_view line)
{
    std::string text(line);
    text += '\n';
    print_bytes(text);
}

} // namespace webots_cloud::demo
