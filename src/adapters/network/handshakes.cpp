#include "handshakes.hpp"

#include <boost/asio/async_result.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <chrono>
#include <utility>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

asio::awaitable<void> Handshakes::turn(std::string const& client)
{
    auto initiate = [this, &client](auto handler) { enqueue(client, std::move(handler)); };
    return asio::async_initiate<asio::use_awaitable_t<> const, void()>(std::move(initiate),
                                                                       asio::use_awaitable);
}

void Handshakes::enqueue(std::string const& client, Waiting waiting)
{
    queue_.push(client, std::move(waiting), std::chrono::steady_clock::now());
    if (queue_.size() == 1)
        schedule();
}

void Handshakes::schedule()
{
    asio::post(executor_, [this] {
        auto waiting = queue_.pop();
        if (queue_.size() > 0)
            schedule();
        std::move (*waiting)();
    });
}

} // namespace webots_cloud::adapters
