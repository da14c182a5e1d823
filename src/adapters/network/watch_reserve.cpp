#include "watch_reserve.hpp"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>

namespace webots_cloud::adapters {

void WatchReserve::fill()
{
    want(side * side, side);
    refill();
}

void WatchReserve::has_failed()
{
    if (wanted_ == 0)
        want(1, 1);
}

void WatchReserve::want(std::size_t count, std::size_t a_side)
{
    for (std::size_t i = watching_.size(); i < a_side; ++i) {
        watching_.emplace_back(::epoll_create1(EPOLL_CLOEXEC));
        watched_.emplace_back(::eventfd(0, EFD_CLOEXEC));
    }
    wanted_ = count;
}

bool WatchReserve::find_free()
{
    if (is_short())
        (void)take(); // where that is possible, one is free
    return let_go();
}

void WatchReserve::refill()
{
    while (is_short() && take())
        continue;
}

bool WatchReserve::take()
{
    epoll_event nothing{};
    bool const taken = ::epoll_ctl(watching_[held_ / side].get(), EPOLL_CTL_ADD, watched_[held_ % side].get(),
                                   &nothing) == 0;
    held_ += taken ? 1 : 0;
    return taken;
}

bool WatchReserve::let_go()
{
    if (held_ == 0)
        return false;
    --held_;
    return ::epoll_ctl(watching_[held_ / side].get(), EPOLL_CTL_DEL, watched_[held_ % side].get(), nullptr) ==
           0;
}

} // namespace webots_cloud::adapters
