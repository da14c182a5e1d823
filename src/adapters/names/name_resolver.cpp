// One lookup for all who ask for a name. While a name server is slow, the last known addresses are used, so
// that a machine that works is not lost for lack of DNS. The questions themselves: name_channel.cpp.
#include "name_resolver.hpp"

#include "core/text.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {

namespace asio = boost::asio;
using core::concat;

namespace {

// Names are those of the configuration and of projects' forges; others are dropped when they are no longer
// requested.
constexpr std::size_t max_records = 4096;

Failure unresolved(std::string const& name, std::string_view why)
{
    return Failure(errc::unreachable,
                   concat("the name ", core::printable(name, 255), " can't be resolved: ", why));
}

NameLookup lookup_by_channel(asio::any_io_executor const& executor)
{
    auto const channel = std::make_shared<NameChannel>(executor);
    return [channel](std::string const& name, std::function<void(result<Addresses>)> answer) {
        channel->ask_addresses(name, true, [answer = std::move(answer)](result<NamedAddresses> found) {
            answer(found ? result<Addresses>(std::move(found->addresses)) : found.error());
        });
    };
}

} // namespace

/// A name that is looked up.
struct NameResolver::Question
{
    explicit Question(asio::any_io_executor const& executor) : patience(executor) {}

    std::optional<result<Addresses>>
        answer; ///< For those who ask now; a lookup that goes on may bring another one.
    std::vector<asio::steady_timer*>
        askers;                  ///< Each expires at its asker's deadline, and is cancelled by the answer.
    asio::steady_timer patience; ///< Expires when the lookup counts as slow.
    bool is_slow = false;

    void tell(result<Addresses> what)
    {
        answer = std::move(what);
        for (auto* const asker : askers)
            asker->cancel();
    }
};

/// Where answers find their resolver, as long as there is one.
struct NameResolver::Home
{
    NameResolver* owner = nullptr;
};

NameResolver::NameResolver(asio::any_io_executor const& executor)
    : NameResolver(executor, lookup_by_channel(executor), NameResolverParams())
{}

NameResolver::NameResolver(asio::any_io_executor executor, NameLookup lookup, NameResolverParams params)
    : executor_(std::move(executor)), lookup_(std::move(lookup)), params_(params),
      home_(std::make_shared<Home>())
{
    home_->owner = this;
}

NameResolver::~NameResolver()
{
    home_->owner = nullptr;
}

asio::awaitable<result<Addresses>> NameResolver::resolve(std::string name, TimePoint deadline)
{
    auto& record = record_of(name);
    auto const now = std::chrono::steady_clock::now();
    record.asked = now;
    if (!record.addresses.empty() && now - record.answered < params_.good_for)
        co_return record.addresses;
    auto const known = questions_.find(name);
    auto question = known == questions_.end() ? nullptr : known->second;
    // A name whose servers were slow the last time is not looked up again so soon.
    if (!question && record.is_slow && now < record.next) {
        if (has_addresses(record))
            co_return record.addresses;
        co_return unresolved(name, "no answer the last time; it will be looked up again in a moment");
    }
    if (!question && questions_.size() >= params_.max_lookups)
        co_return unresolved(name, "too many names are being looked up");
    asio::steady_timer timer(executor_, deadline);
    bool const was_slow = record.is_slow;
    if (!question)
        question = begin(name); // which may answer at once
    if (has_addresses(record) && (was_slow || question->is_slow))
        co_return record.addresses; // the lookup goes on for the next who ask
    if (question->answer && !question->is_slow)
        co_return *question->answer;
    // The timer is the deadline, and also what the answer wakes us by.
    question->askers.push_back(&timer);
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

std::shared_ptr<NameResolver::Question> NameResolver::begin(std::string const& name)
{
    auto const question = std::make_shared<Question>(executor_);
    questions_.emplace(name, question);
    question->patience.expires_after(params_.slow_after);
    question->patience.async_wait(
        [home = home_, name, weak = std::weak_ptr(question)](boost::system::error_code cancelled) {
            auto const slow = weak.lock();
            if (!cancelled && home->owner && slow && !slow->answer)
                home->owner->turn_slow(name, *slow);
        });
    lookup_(name, [home = home_, name](result<Addresses> answer) {
        if (home->owner)
            home->owner->take_answer(name, std::move(answer));
    });
    return question;
}

/// The lookup takes long: its callers get the last known addresses.
void NameResolver::turn_slow(std::string const& name, Question& question)
{
    auto& record = records_[name];
    record.is_slow = true;
    question.is_slow = true;
    if (has_addresses(record))
        question.tell(record.addresses);
}

void NameResolver::take_answer(std::string const& name, result<Addresses> answer)
{
    auto const question = questions_.extract(name).mapped();
    question->patience.cancel();
    auto const now = std::chrono::steady_clock::now();
    auto& record = records_[name];
    bool const was_prompt = !question->is_slow;
    record.is_slow = !was_prompt;
    record.pause =
        was_prompt ? Duration::zero() : std::clamp(2 * record.pause, params_.first_pause, params_.max_pause);
    record.next = now + record.pause;
    // A late failure does not take away addresses that have worked; one that came at once does.
    record.addresses = answer ? *answer : was_prompt ? Addresses() : std::move(record.addresses);
    if (answer)
        record.answered = now;
    question->tell(std::move(answer));
}

} // namespace webots_cloud::adapters
