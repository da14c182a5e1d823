#include "name_resolver.hpp"

#include "core/text.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <netdb.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

// Names are those of the configuration and of projects' forges; others are dropped when they are no longer
// requested.
constexpr std::size_t max_records = 4096;

constexpr std::size_t total_factor = 4;

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
    explicit Question(asio::any_io_executor const& executor) : patience(executor) {}

    std::optional<result<Addresses>>
        answer; ///< For those who ask now; a lookup that goes on may bring another one.
    std::vector<asio::steady_timer*>
        askers;                  ///< Each expires at its asker's deadline, and is cancelled by the answer.
    asio::steady_timer patience; ///< Expires when the lookup counts as slow.
    bool is_slow = false;
    bool is_wanted = false; ///< By somebody who does not wait for it.

    void tell(result<Addresses> what)
    {
        answer = std::move(what);
        for (auto* const asker : askers)
            if (asker)
                asker->cancel();
    }
};

/// Where threads bring their answers, as long as there is somebody.
struct NameResolver::Home
{
    explicit Home(NameResolver* resolver) : owner(resolver) {}

    std::mutex mutex;
    NameResolver* owner; ///< Null once it is destroyed.
};

NameResolver::NameResolver(asio::any_io_executor executor, NameLookup lookup, NameResolverParams params)
    : executor_(std::move(executor)), lookup_(std::move(lookup)), params_(params),
      home_(std::make_shared<Home>(this))
{}

NameResolver::~NameResolver()
{
    std::scoped_lock const lock(home_->mutex);
    home_->owner = nullptr;
}

asio::awaitable<result<Addresses>> NameResolver::resolve(std::string name, TimePoint deadline)
{
    auto& record = record_of(name);
    auto const now = std::chrono::steady_clock::now();
    record.asked = now;
    auto& entry = questions_[name];
    if (!entry && record.is_slow && now < record.next) {
        questions_.erase(name);
        if (has_addresses(record))
            co_return record.addresses;
        co_return unresolved(name, "no answer the last time; it will be looked up again in a moment");
    }
    if (!entry) {
        entry = std::make_shared<Question>(executor_);
        (record.is_slow ? slow_waiting_ : waiting_).push_back(name);
    }
    auto const question = entry;
    if (has_addresses(record) && (record.is_slow || question->is_slow)) {
        question->is_wanted = true; // for the next who ask
        start_lookups();
        co_return record.addresses;
    }
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

NameResolver::Record& NameResolver::record_of(std::string const& name)
{
    if (records_.size() >= max_records)
        forget_old_records();
    return records_[name];
}

bool NameResolver::has_addresses(Record const& record) const
{
    return !record.addresses.empty() && std::chrono::steady_clock::now() - record.answered < params_.memory;
}

/// Those that have not been requested for a while.
void NameResolver::forget_old_records()
{
    auto const now = std::chrono::steady_clock::now();
    std::erase_if(records_, [&](auto const& entry) {
        return now - entry.second.asked >= params_.max_pause && !questions_.contains(entry.first);
    });
}

void NameResolver::start_lookups()
{
    while (prompt_ < params_.threads && prompt_ + slow_ < total_factor * params_.threads)
        if (!start_next(waiting_))
            break;
    while (slow_ < params_.slow_threads)
        if (!start_next(slow_waiting_))
            break;
}

/// False when none is waiting.
bool NameResolver::start_next(std::deque<std::string>& waiting)
{
    if (waiting.empty())
        return false;
    auto const name = std::move(waiting.front());
    waiting.pop_front();
    auto const question = questions_[name];
    if (question->askers.empty() && !question->is_wanted) { // no caller waits any more
        questions_.erase(name);
        return true;
    }
    question->is_slow = &waiting == &slow_waiting_;
    ++(question->is_slow ? slow_ : prompt_);
    question->patience.expires_after(params_.slow_after);
    question->patience.async_wait([home = home_, name, question](boost::system::error_code error) {
        if (!error && home->owner && home->owner->is_asked(name, *question))
            home->owner->turn_slow(name, *question);
    });
    try {
        std::thread(answer, name, lookup_, home_).detach();
    } catch (std::system_error const& failure) {
        take_answer(name, unresolved(name, failure.what()));
    }
    return true;
}

/// Still, and not again.
bool NameResolver::is_asked(std::string const& name, Question const& question) const
{
    auto const found = questions_.find(name);
    return found != questions_.end() && found->second.get() == &question;
}

/// The lookup takes long: it makes room for others, and its callers get the last known addresses.
void NameResolver::turn_slow(std::string const& name, Question& question)
{
    auto& record = records_[name];
    record.is_slow = true;
    if (!question.is_slow) {
        question.is_slow = true;
        --prompt_;
        ++slow_;
    }
    if (has_addresses(record))
        question.tell(record.addresses);
    start_lookups();
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
    auto const question = questions_.extract(name).mapped();
    --(question->is_slow ? slow_ : prompt_);
    auto const now = std::chrono::steady_clock::now();
    auto& record = records_[name];
    bool const was_prompt = question->patience.cancel() > 0;
    record.is_slow = !was_prompt;
    record.pause =
        was_prompt ? Duration::zero() : std::clamp(2 * record.pause, params_.first_pause, params_.max_pause);
    record.next = now + record.pause;
    record.addresses = answer ? *answer : was_prompt ? Addresses() : std::move(record.addresses);
    if (answer)
        record.answered = now;
    question->tell(std::move(answer));
    start_lookups();
}

} // namespace webots_cloud::adapters
