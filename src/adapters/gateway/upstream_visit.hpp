// A short conversation of our own with a simulator, reached as requests of browsers are passed on to it.
#pragma once

#include "upstream_socket.hpp"

#include <boost/asio/steady_timer.hpp>

#include <memory>
#include <utility>

namespace webots_cloud::adapters {

/// Closes its socket when the time for all of it is over: connection, questions, answers.
class UpstreamVisit
{
public:
    /// `upstreams` must outlive it.
    UpstreamVisit(boost::asio::any_io_executor const& executor, Upstreams& upstreams, Duration patience)
        : socket_(executor, upstreams), deadline_(executor, patience)
    {
        // A timer that has expired already is not cancelled: then it finds no socket.
        deadline_.async_wait([open = open_](boost::system::error_code error) {
            if (!error && *open)
                std::exchange(*open, nullptr)->close();
        });
    }
    UpstreamVisit(UpstreamVisit const&) = delete;
    UpstreamVisit& operator=(UpstreamVisit const&) = delete;
    ~UpstreamVisit() { *open_ = nullptr; }

    UpstreamSocket& socket() noexcept { return socket_; }

    bool is_late() const noexcept { return *open_ == nullptr; }

private:
    UpstreamSocket socket_;
    std::shared_ptr<UpstreamSocket*> open_ = std::make_shared<UpstreamSocket*>(&socket_);
    boost::asio::steady_timer deadline_;
};

} // namespace webots_cloud::adapters
