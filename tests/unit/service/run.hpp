// The life of a service as a task of a TaskGroup.
#pragma once

#include <boost/asio/awaitable.hpp>

namespace webots_cloud {

/// Tests see from its log and its effects how a service ended.   Lifetime: the service outlives the task.
template<class Service>
boost::asio::awaitable<void> run(Service& service)
{
    (void)co_await service.run();
}

} // namespace webots_cloud
