#include "git_flights.hpp"

#include "async/cancellation.hpp"
#include "adapters/threads/errand.hpp"

#include <boost/asio/error.hpp>
#include <boost/asio/this_coro.hpp>

#include <list>
#include <optional>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

struct GitFlights::Flight
{
    explicit Flight(Make const& make) : fetch(make(aborted, progress)) {}

    void land(result<GitFetched> with)
    {
        outcome = std::move(with);
        for (auto& waiter : waiting)
            waiter.notify();
    }

    std::atomic<bool> aborted{false};
    GitProgress progress;
    GitFetch fetch;
    std::optional<result<GitFetched>> outcome; ///< Set on the executor.
    std::list<async::Wakeup> waiting;
};

GitFlights::~GitFlights()
{
    for (auto const& [key, flight] : flights_)
        flight->aborted = true;
    looking_up_.join();
    downloading_.join();
}

std::shared_ptr<GitFlights::Flight> GitFlights::start(std::string const& key, Make const& make)
{
    auto flight = std::make_shared<Flight>(make);
    flights_[key] = flight;
    auto work = [flight] { return flight->fetch.look_up(); };
    send_on_errand(looking_up_, home_, std::move(work),
                   [this, flight](std::optional<result<GitFetched>> found) {
                       if (found)
                           flight->land(std::move(*found));
                       else if (flight->aborted) // nobody waits for it any more; we may be gone ourselves
                           flight->land(Failure(asio::error::operation_aborted));
                       else
                           download(flight);
                   });
    return flight;
}

void GitFlights::download(std::shared_ptr<Flight> flight)
{
    auto work = [flight] { return flight->fetch.download(); };
    send_on_errand(downloading_, home_, std::move(work),
                   [flight](result<GitFetched> outcome) { flight->land(std::move(outcome)); });
}

asio::awaitable<result<GitFetched>> GitFlights::join(std::string key, std::shared_ptr<FetchProgress> progress,
                                                     Make make)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    bool const cancelled = co_await async::is_cancelled();
    if (cancelled)
        co_return Failure(asio::error::operation_aborted);
    auto const found = flights_.find(key);
    auto const flight = found != flights_.end() ? found->second : start(key, make);
    flight->progress.join(std::move(progress));
    auto const executor = co_await asio::this_coro::executor;
    auto const turn = flight->waiting.emplace(flight->waiting.end(), executor);
    while (!flight->outcome) {
        auto const woken = co_await turn->wait();
        if (!woken)
            break;
    }
    flight->waiting.erase(turn);
    // The first to leave a finished flight, or the last to leave a hopeless one, makes room for a new one.
    auto const over = flight->outcome.has_value() || flight->waiting.empty();
    if (auto const current = flights_.find(key);
        over && current != flights_.end() && current->second == flight)
        flights_.erase(current);
    if (flight->outcome)
        co_return *flight->outcome;
    if (over)
        flight->aborted = true;
    co_return Failure(asio::error::operation_aborted);
}

} // namespace webots_cloud::adapters
