// The life of a service as a task of a TaskGroup.
#pragma once

#include <boost/asio/awaitable.hpp>

namespace webots_cloud {

/// How a service ends is told by its log and its effects.   Lifetime: the service outlives the task.
template<class Service>
boost::asio::awaitable<void> run(Service& service)
{
    (void)co_await service.run();
}

} // namespace webots_cloud
