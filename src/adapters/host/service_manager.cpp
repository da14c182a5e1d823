#include <webots_cloud/adapters/host.hpp>

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <charconv>
#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace webots_cloud {
namespace {

std::string_view environment(char const* name)
{
    char const* const value = std::getenv(name);
    return value ? value : "";
}

long long number(std::string_view text)
{
    long long value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
}

/// sd_notify(3), "Notes": datagrams to the socket that NOTIFY_SOCKET names.
class NotifySocket final : public ServiceManager
{
public:
    NotifySocket()
    {
        auto const path = environment("NOTIFY_SOCKET");
        if (path.size() < 2 || path.size() >= sizeof address_.sun_path || (path[0] != '/' && path[0] != '@'))
            return;
        address_.sun_family = AF_UNIX;
        std::memcpy(address_.sun_path, path.data(), path.size());
        if (path[0] == '@')
            address_.sun_path[0] = '\0'; // an abstract name, which has no final zero either
        size_ = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path.size());
        socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    }

    ~NotifySocket() override
    {
        if (socket_ >= 0)
            ::close(socket_);
    }

    NotifySocket(NotifySocket const&) = delete;
    NotifySocket& operator=(NotifySocket const&) = delete;

    void tell(std::string_view state) noexcept override
    {
        if (socket_ >= 0)
            (void)::sendto(socket_, state.data(), state.size(), MSG_NOSIGNAL,
                           reinterpret_cast<sockaddr const*>(&address_), size_);
    }

    std::optional<Duration> watchdog() const noexcept override
    {
        auto const process = environment("WATCHDOG_PID");
        auto const microseconds = number(environment("WATCHDOG_USEC"));
        bool const ours = process.empty() || number(process) == ::getpid();
        if (socket_ < 0 || !ours || microseconds <= 0)
            return std::nullopt;
        return std::chrono::microseconds(microseconds);
    }

private:
    sockaddr_un address_{};
    socklen_t size_ = 0;
    int socket_ = -1;
};

} // namespace

std::unique_ptr<ServiceManager> make_service_manager()
{
    return std::make_unique<NotifySocket>();
}

} // namespace webots_cloud
