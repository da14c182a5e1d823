// Runs coroutines in virtual time, and fails when they wait for something that can never happen.
#pragma once

#include <webots_cloud/testing/manual_clock.hpp>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <utility>

namespace webots_cloud::testing {

/// One executor and one manual clock: the world of a test.
///
/// Declare it first in a test, so that everything that runs in it is destroyed before it.
class World
{
public:
    World() : clock(context_.get_executor()) {}

    boost::asio::any_io_executor executor() { return context_.get_executor(); }

    /// Runs everything that can run without time passing.
    void settle()
    {
        do {
            context_.restart();
            context_.poll();
        } while (clock.fire_next(clock.now()));
    }

    /// Lets time pass, running what comes due in order.
    void advance(Duration duration)
    {
        auto const until = clock.now() + duration;
        settle();
        while (clock.fire_next(until))
            settle();
        clock.move_to(until);
        settle();
    }

    /// Runs a coroutine to its end, letting time pass as needed, and returns its value.
    ///
    /// Throws `std::logic_error` when nothing is left that could wake it: a deadlock.
    template<class T>
    T run(boost::asio::awaitable<T> body)
    {
        struct Outcome
        {
            std::optional<T> value;
            std::exception_ptr failure;
        };
        auto const outcome =
            std::make_shared<Outcome>(); // shared: after a deadlock the coroutine outlives this call
        boost::asio::co_spawn(context_, std::move(body), [outcome](std::exception_ptr failure, T value) {
            outcome->failure = failure;
            outcome->value.emplace(std::move(value));
        });
        for (settle(); !outcome->value; settle())
            if (!clock.fire_next())
                throw std::logic_error("deadlock: the coroutine waits for something that can never happen");
        if (outcome->failure)
            std::rethrow_exception(outcome->failure);
        return std::move(*outcome->value);
    }

    void run(boost::asio::awaitable<void> body) { run(with_value(std::move(body))); }

    /// Starts a coroutine that runs concurrently with the test.
    template<class T>
    void spawn(boost::asio::awaitable<T> body)
    {
        boost::asio::co_spawn(context_, std::move(body), [](std::exception_ptr error, auto&&...) {
            if (error)
                std::rethrow_exception(error);
        });
    }

private:
    static boost::asio::awaitable<bool> with_value(boost::asio::awaitable<void> body)
    {
        co_await std::move(body);
        co_return true;
    }

    boost::asio::io_context context_{1};

public:
    ManualClock clock;
};

} // namespace webots_cloud::testing
