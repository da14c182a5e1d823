// A bounded number of coroutines at a time, first come, first served.
#pragma once

#include "wakeup.hpp"

#include <list>
#include <utility>

namespace webots_cloud::async {

/// Lifetime: must outlive its passes.   Thread-safety: one executor.
class Semaphore
{
public:
    explicit Semaphore(int count) : free_(count) {}

    /// One of the places, given back when destroyed.
    class Pass
    {
    public:
        explicit Pass(Semaphore& owner) : owner_(&owner) {}
        Pass(Pass&& other) noexcept : owner_(std::exchange(other.owner_, nullptr)) {}
        Pass& operator=(Pass&&) = delete;
        ~Pass()
        {
            if (owner_)
                owner_->release();
        }

    private:
        Semaphore* owner_;
    };

    /// Waits for a place.   Cancellation: terminal; the place in the queue is given up.   Errors: `operation_aborted`.
    boost::asio::awaitable<result<Pass>> acquire()
    {
        if (free_ > 0 && queue_.empty()) {
            --free_;
            co_return Pass(*this);
        }
        auto const executor = co_await boost::asio::this_coro::executor;
        auto const turn = queue_.emplace(queue_.end(), executor);
        auto const woken = co_await turn->called.wait();
        bool const has_turn = turn->has_place;
        queue_.erase(turn);
        if (has_turn && !woken)
            release(); // called and cancelled at the same moment: the place goes to the next one
        if (!woken)
            co_return woken.error();
        co_return Pass(*this);
    }

    std::size_t waiting() const noexcept { return queue_.size(); }

private:
    struct Turn
    {
        explicit Turn(boost::asio::any_io_executor const& executor) : called(executor) {}

        Wakeup called;
        bool has_place = false;
    };

    void release()
    {
        for (auto& turn : queue_) {
            if (!turn.has_place) {
                turn.has_place = true;
                turn.called.notify();
                return;
            }
        }
        ++free_;
    }

    int free_;
    std::list<Turn> queue_;
};

} // namespace webots_cloud::async
