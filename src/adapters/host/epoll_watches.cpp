#include "epoll_watches.hpp"

#include <array>
#include <cerrno>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

namespace webots_cloud::adapters {
namespace {

constexpr std::size_t first_watches = 32; // more than a server needs until its first connection

} // namespace

result<> find_watches()
{
    std::array<int, first_watches> watched{};
    int const epoll = ::epoll_create1(EPOLL_CLOEXEC);
    bool are_taken = false;
    for (auto& each : watched) {
        each = ::eventfd(0, EFD_CLOEXEC);
        epoll_event nothing{};
        are_taken = are_taken || (::epoll_ctl(epoll, EPOLL_CTL_ADD, each, &nothing) != 0 && errno == ENOSPC);
    }
    for (int const each : watched)
        ::close(each);
    ::close(epoll);
    if (!are_taken)
        return {};
    return Failure(
        errc::unavailable,
        "programs of this user have taken all epoll watches that the kernel gives a user, and without any "
        "a server hears nothing. End the one that holds them (one that an earlier server has left, for "
        "instance), run the server as a user of its own, or raise fs.epoll.max_user_watches");
}

} // namespace webots_cloud::adapters
