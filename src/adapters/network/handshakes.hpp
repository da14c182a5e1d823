// Handshakes of TLS, one after the other, so that nobody else waits for many.
#pragma once

#include "address_space.hpp"
#include "core/access/fair_queue.hpp"

#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <string>

namespace webots_cloud::adapters {

/// One step of a handshake takes up to a millisecond, more than all else that a connection ever asks for. The
/// event loop makes one in each of its turns, and does between two of them what there is to do; whose step it
/// is, `FairQueue` says.
///
/// Lifetime: must outlive those that wait.   Thread-safety: one executor.
class Handshakes
{
public:
    /// Lifetime: `memory` must outlive it.
    Handshakes(boost::asio::any_io_executor executor, AddressSpace& memory)
        : executor_(std::move(executor)), memory_(memory)
    {}

    /// Whether one more may begin.
    bool has_memory() { return memory_.has_room(); }

    /// Waits until it is the turn of `client` (a quota key, or an address), which lasts until the coroutine
    /// waits for something else. Not cancellable: when many wait, look afterwards whether the step still
    /// makes sense.   Lifetime: `client` must outlive the operation.
    boost::asio::awaitable<void> turn(std::string const& client);

private:
    using Waiting = boost::asio::any_completion_handler<void()>;

    void enqueue(std::string const& client, Waiting waiting);
    void schedule();

    boost::asio::any_io_executor executor_;
    AddressSpace& memory_;
    core::FairQueue<Waiting> queue_;
};

} // namespace webots_cloud::adapters
