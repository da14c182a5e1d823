#include "first_of.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/deferred.hpp>
#include <boost/asio/experimental/parallel_group.hpp>
#include <boost/asio/this_coro.hpp>

#include <exception>

namespace webots_cloud::async {

namespace asio = boost::asio;

Part as_part(asio::awaitable<void> body)
{
    co_await std::move(body);
    co_return result<>();
}

Part first_of(std::vector<Part> parts)
{
    auto const executor = co_await asio::this_coro::executor;
    using Task = decltype(co_spawn(executor, std::move(parts.front()), asio::deferred));
    std::vector<Task> tasks;
    tasks.reserve(parts.size());
    for (auto& part : parts)
        tasks.push_back(co_spawn(executor, std::move(part), asio::deferred));
    auto group = asio::experimental::make_parallel_group(std::move(tasks));
    // Unlike Asio's `||`, which waits for a success, and lets the others go on beside a part that has thrown.
    auto ended = group.async_wait(asio::experimental::wait_for_one(), asio::deferred);
    auto const [order, failures, results] = co_await std::move(ended);
    auto const first = order.front();
    if (failures[first])
        std::rethrow_exception(failures[first]);
    co_return results[first];
}

} // namespace webots_cloud::async
