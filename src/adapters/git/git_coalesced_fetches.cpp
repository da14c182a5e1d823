#include "git_coalesced_fetches.hpp"

#include "adapters/threads/offloaded_task.hpp"
#include "async/cancellation.hpp"

#include <boost/asio/error.hpp>
#include <boost/asio/this_coro.hpp>

#include <list>
#include <optional>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

/// One fetch, and those who wait for its outcome.
struct GitCoalescedFetches::CoalescedFetch
{
    explicit CoalescedFetch(Make const& make) : fetch(make(aborted, progress)) {}

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

GitCoalescedFetches::~GitCoalescedFetches()
{
    for (auto const& [key, shared] : fetches_)
        shared->aborted = true;
    looking_up_.join();
    downloading_.join();
}

std::shared_ptr<GitCoalescedFetches::CoalescedFetch> GitCoalescedFetches::start(std::string const& key,
                                                                                Make const& make)
{
    auto shared = std::make_shared<CoalescedFetch>(make);
    fetches_[key] = shared;
    auto work = [shared] { return shared->fetch.look_up(); };
    offload(looking_up_, home_, std::move(work), [this, shared](std::optional<result<GitFetched>> found) {
        if (found)
            shared->land(std::move(*found));
        else if (shared->aborted) // it has no callers any more; this object may be destroyed
            shared->land(Failure(asio::error::operation_aborted));
        else
            download(shared);
    });
    return shared;
}

void GitCoalescedFetches::download(std::shared_ptr<CoalescedFetch> shared)
{
    auto work = [shared] { return shared->fetch.download(); };
    offload(downloading_, home_, std::move(work),
            [shared](result<GitFetched> outcome) { shared->land(std::move(outcome)); });
}

asio::awaitable<result<GitFetched>>
GitCoalescedFetches::join(std::string key, std::shared_ptr<FetchProgress> progress, Make make)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    bool const cancelled = co_await async::is_cancelled();
    if (cancelled)
        co_return Failure(asio::error::operation_aborted);
    // What is under way already is not begun again.
    auto const found = fetches_.find(key);
    auto const shared = found != fetches_.end() ? found->second : start(key, make);
    shared->progress.join(std::move(progress));
    auto const executor = co_await asio::this_coro::executor;
    auto const turn = shared->waiting.emplace(shared->waiting.end(), executor);
    while (!shared->outcome) {
        auto const woken = co_await turn->wait();
        if (!woken)
            break;
    }
    shared->waiting.erase(turn);
    // Whoever leaves a finished fetch, or is the last to leave an unfinished one, takes it off the list: the
    // next caller begins a new one.
    auto const over = shared->outcome.has_value() || shared->waiting.empty();
    if (auto const current = fetches_.find(key);
        over && current != fetches_.end() && current->second == shared)
        fetches_.erase(current);
    if (shared->outcome)
        co_return *shared->outcome;
    if (over)
        shared->aborted = true;
    co_return Failure(asio::error::operation_aborted);
}

} // namespace webots_cloud::adapters
