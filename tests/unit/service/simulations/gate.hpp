// Work that can't be cancelled, such as that of another thread, and that ends when the test says so.
#pragma once

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <functional>
#include <memory>
#include <utility>

namespace webots_cloud {

/// Open at first. For one that waits.
class Gate
{
public:
    explicit Gate(boost::asio::any_io_executor executor) : executor_(std::move(executor)) {}

    bool is_open() const { return is_open_; }
    bool is_awaited() const { return static_cast<bool>(pass_); }

    void close() { is_open_ = false; }

    void open()
    {
        is_open_ = true;
        if (pass_)
            boost::asio::post(executor_, std::exchange(pass_, nullptr));
    }

    boost::asio::awaitable<void> pass()
    {
        if (is_open_)
            co_return;
        Initiation wait(*this);
        co_await boost::asio::async_initiate<boost::asio::use_awaitable_t<> const, void()>(
            std::move(wait), boost::asio::use_awaitable);
    }

private:
    class Initiation
    {
    public:
        explicit Initiation(Gate& gate) : gate_(&gate) {}

        template<class Handler>
        void operator()(Handler handler)
        {
            auto const waiting = std::make_shared<Handler>(std::move(handler));
            gate_->pass_ = [waiting] { std::move (*waiting)(); };
        }

    private:
        Gate* gate_;
    };

    boost::asio::any_io_executor executor_;
    bool is_open_ = true;
    std::function<void()> pass_;
};

} // namespace webots_cloud
