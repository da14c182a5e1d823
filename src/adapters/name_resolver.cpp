#include "name_resolver.hpp"

#include "../core/text.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <netdb.h>

#include <cstring>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

Failure unresolved(std::string const& name, std::string_view why)
{
    return Failure(errc::unreachable,
                   concat("the name ", core::printable(name, 255), " can't be resolved: ", why));
}

} // namespace

result<Addresses> look_up(std::string const& name)
{
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    if (int const failed = ::getaddrinfo(name.c_str(), nullptr, &hints, &found); failed != 0)
        return unresolved(name, failed == EAI_SYSTEM ? std::strerror(errno) : ::gai_strerror(failed));
    Addresses addresses;
    for (auto const* entry = found; entry; entry = entry->ai_next) {
        asio::ip::tcp::endpoint endpoint;
        if (entry->ai_addrlen > endpoint.capacity())
            continue;
        std::memcpy(endpoint.data(), entry->ai_addr, entry->ai_addrlen);
        addresses.push_back(endpoint.address());
    }
    ::freeaddrinfo(found);
    return addresses;
}

/// A name that somebody waits for.
struct NameResolver::Question
{
    std::optional<result<Addresses>> answer;
    std::vector<asio::steady_timer*>
        askers; ///< Each expires at its asker's deadline, and is cancelled by the answer.
};

/// Where threads bring their answers, as long as there is somebody.
struct NameResolver::Home
{
    explicit Home(NameResolver* resolver) : owner(resolver) {}

    std::mutex mutex;
    NameResolver* owner; ///< Null once it is destroyed.
};

NameResolver::NameResolver(asio::any_io_executor executor, NameLookup lookup, std::size_t most_threads)
    : executor_(std::move(executor)), lookup_(std::move(lookup)), free_threads_(most_threads),
      home_(std::make_shared<Home>(this))
{}

NameResolver::~NameResolver()
{
    std::scoped_lock const lock(home_->mutex);
    home_->owner = nullptr;
}

asio::awaitable<result<Addresses>> NameResolver::resolve(std::string name, TimePoint deadline)
{
    auto& entry = questions_[name];
    if (!entry) {
        entry = std::make_shared<Question>();
        waiting_.push_back(name);
    }
    auto const question = entry;
    asio::steady_timer timer(executor_, deadline);
    question->askers.push_back(&timer);
    start_lookups();
    auto const [cancelled] = co_await timer.async_wait(asio::as_tuple(asio::use_awaitable));
    std::erase(question->askers, &timer);
    if (question->answer)
        co_return *question->answer;
    if (cancelled)
        co_return Failure(asio::error::operation_aborted);
    co_return unresolved(name, "no answer in time");
}

void NameResolver::start_lookups()
{
    while (free_threads_ > 0 && !waiting_.empty()) {
        auto const name = std::move(waiting_.front());
        waiting_.pop_front();
        if (questions_[name]->askers.empty()) { // nobody waits any more
            questions_.erase(name);
            continue;
        }
        --free_threads_;
        try {
            std::thread(answer, name, lookup_, home_).detach();
        } catch (std::system_error const& failure) {
            take_answer(name, unresolved(name, failure.what()));
        }
    }
}

/// On a thread that may outlive us.
void NameResolver::answer(std::string const& name, NameLookup const& lookup,
                          std::shared_ptr<Home> const& home)
{
    auto addresses = lookup(name);
    std::scoped_lock const lock(home->mutex);
    if (!home->owner)
        return;
    asio::post(home->owner->executor_, [home, name, addresses = std::move(addresses)] {
        if (home->owner)
            home->owner->take_answer(name, addresses);
    });
}

void NameResolver::take_answer(std::string const& name, result<Addresses> answer)
{
    ++free_threads_;
    auto const question = questions_.extract(name).mapped();
    question->answer = std::move(answer);
    for (auto* const asker : question->askers)
        asker->cancel();
    start_lookups();
}

} // namespace webots_cloud::adapters
