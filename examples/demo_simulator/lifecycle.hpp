#pragma once

#include "command_line.hpp"
#include "streaming_server.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <deque>

namespace webots_cloud::demo {

/// From the first line on stdout to the heartbeats, with the faults in between.
class Lifecycle
{
public:
    explicit Lifecycle(Options const& options);

    /// Runs until a signal or a fault ends the process. Throws std::runtime_error when the port or the world
    /// cannot be used.
    void run();

private:
    void get_ready();
    void announce_ready();
    void schedule_heartbeat();
    void schedule_end();
    void flood();
    template<class Action>
    void after(std::chrono::milliseconds delay, Action action);

    Options const& options_;
    boost::asio::io_context context_{1};
    StreamingServer server_;
    boost::asio::steady_timer heartbeat_;
    std::deque<boost::asio::steady_timer> timers_; ///< of the faults
};

} // namespace webots_cloud::demo
