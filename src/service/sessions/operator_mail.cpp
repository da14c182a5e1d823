// Sends the operator what is worth a mail: the first at once, later ones as a digest. A mail server that
// does not answer delays nothing but mails.
// Decisions: core/notices/news_digest, core/notices/notice_queue.
#include <webots_cloud/operator_mail.hpp>

#include "async/cancellation.hpp"
#include "async/first_of.hpp"
#include "async/wakeup.hpp"
#include "core/notices/news_digest.hpp"
#include "core/notices/notice_queue.hpp"
#include "core/notices/notification.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// For mails that wait when the server ends: whoever ends it waits as well.
constexpr auto last_delivery = std::chrono::seconds(5);

} // namespace

struct OperatorMail::Impl
{
    Impl(std::string recipient, PublicAddress const& server, Notifier& delivering, Clock& time, Logger logger)
        : administrator(std::move(recipient)), port(server.port), notifier(delivering), clock(time),
          log(std::move(logger)), monitor(core::monitor_url(server))
    {}

    std::optional<TimePoint> next_due() const;
    void post(Notice notice);
    void post_digest();
    void settle(core::NoticeQueue::Attempt const& attempt, result<> const& outcome);
    void give_up(Notice const& notice, std::string_view why);
    void give_up_everything(std::string_view why);
    std::string new_id();
    asio::awaitable<void> wait();
    asio::awaitable<void> deliver();
    asio::awaitable<result<>> deliver_all();
    asio::awaitable<void> end();

    std::string administrator;
    std::uint16_t port; ///< Of the session server.
    Notifier& notifier;
    Clock& clock;
    Logger log;
    std::string monitor;
    core::NewsDigest digest;
    core::NoticeQueue queue;
    std::optional<async::Wakeup> changed; // while run() is awaited
    std::optional<Failure> problem;       // why the last attempt failed; none after a good one
    std::uint64_t notices = 0;
    OperatorMailStatistics counts; // but for `waiting`, which is counted when asked for
};

OperatorMail::OperatorMail(std::string administrator, PublicAddress const& server, Notifier& notifier,
                           Clock& clock, Logger log)
    : impl_(std::make_unique<Impl>(std::move(administrator), server, notifier, clock, std::move(log)))
{}

OperatorMail::~OperatorMail() = default;

void OperatorMail::apply(std::string administrator, PublicAddress const& server)
{
    if (administrator.empty())
        impl_->give_up_everything("no recipient is configured any more");
    impl_->administrator = std::move(administrator);
    impl_->port = server.port;
    impl_->monitor = core::monitor_url(server);
    impl_->problem.reset();
    impl_->queue.retry();
    if (impl_->changed)
        impl_->changed->notify();
}

bool OperatorMail::note(LoadEvent const& event)
{
    if (impl_->administrator.empty() || !core::is_news(event.transition))
        return false;
    core::News const news(event, impl_->clock.wall());
    if (impl_->digest.at_once(event.server.address, news, impl_->clock.now()))
        impl_->post(core::news_notice(news, impl_->monitor));
    if (impl_->changed)
        impl_->changed->notify();
    return true;
}

OperatorMailStatistics OperatorMail::statistics() const noexcept
{
    auto statistics = impl_->counts;
    statistics.waiting = impl_->queue.waiting().size();
    return statistics;
}

asio::awaitable<result<>> OperatorMail::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    impl_->changed.emplace(executor);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            break;
        auto const now = impl_->clock.now();
        if (auto const due = impl_->digest.due(); due && *due <= now)
            impl_->post_digest();
        if (auto const due = impl_->queue.due(); due && *due <= now) {
            co_await impl_->deliver();
        } else {
            co_await impl_->wait();
        }
    }
    impl_->changed.reset();
    // We have been cancelled already, which must not end the delivery of what still waits.
    co_await async::uncancellable(impl_->end());
    co_return Failure(asio::error::operation_aborted);
}

std::optional<TimePoint> OperatorMail::Impl::next_due() const
{
    auto const delivery = queue.due();
    auto const collected = digest.due();
    if (delivery && collected)
        return std::min(*delivery, *collected);
    return delivery ? delivery : collected;
}

/// Tries to deliver the oldest notice.
asio::awaitable<void> OperatorMail::Impl::deliver()
{
    auto const attempt = queue.attempt();
    auto const outcome = co_await notifier.deliver(attempt.notice);
    bool const ended = co_await async::is_cancelled();
    if (outcome || !ended)
        settle(attempt, outcome);
    else // cancelled, and so no failed one; but this mail server is too slow for another
        problem = outcome.error();
}

asio::awaitable<result<>> OperatorMail::Impl::deliver_all()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled || queue.empty() || problem)
            co_return result<>();
        co_await deliver();
    }
}

/// Delivers what waits, a digest that is being collected, too, unless the mail server is down or slow.
asio::awaitable<void> OperatorMail::Impl::end()
{
    if (digest.due())
        post_digest();
    auto either = async::first_of(deliver_all(), clock.wait_until(clock.now() + last_delivery));
    (void)co_await std::move(either);
    give_up_everything("the session server ends");
}

/// Waits until a notice is due, or something has changed.
asio::awaitable<void> OperatorMail::Impl::wait()
{
    auto const due = next_due();
    if (!due) {
        (void)co_await changed->wait();
        co_return;
    }
    auto either = async::first_of(clock.wait_until(*due), changed->wait());
    (void)co_await std::move(either);
}

void OperatorMail::Impl::post(Notice notice)
{
    notice.id = new_id();
    if (auto const dropped = queue.push(std::move(notice)))
        give_up(*dropped, "too many are waiting");
}

void OperatorMail::Impl::post_digest()
{
    auto const collected = digest.take();
    post(core::digest_notice(collected.news, collected.left_out, monitor));
}

void OperatorMail::Impl::settle(core::NoticeQueue::Attempt const& attempt, result<> const& outcome)
{
    ++(outcome ? counts.sent : counts.failed);
    if (outcome) {
        if (problem)
            log.info(concat("Emails to ", administrator, " are sent again"));
        problem.reset();
        queue.delivered(attempt);
        return;
    }
    auto const failure = outcome.error();
    // Compares codes, not messages: messages contain durations, so each would count as a new problem and be
    // logged.
    if (!problem || !(*problem == failure))
        log.error(concat("Error: unable to send email to ", administrator, ": ",
                         core::printable(failure.message())));
    problem = failure;
    if (auto const refused = queue.failed(attempt, failure, clock.now()))
        give_up(*refused, "it was refused again and again");
}

/// Writes to the log what could not be delivered to the administrator.
void OperatorMail::Impl::give_up(Notice const& notice, std::string_view why)
{
    ++counts.given_up;
    log.warning(concat("Email to ", administrator, " not sent (", why, "): ", notice.summary));
}

void OperatorMail::Impl::give_up_everything(std::string_view why)
{
    if (digest.due())
        post_digest();
    for (auto const& notice : queue.clear())
        give_up(notice, why);
}

/// Unique on this host: the time in microseconds, a count, and the port, since several session servers may
/// send at the same moment.
std::string OperatorMail::Impl::new_id()
{
    auto const moment =
        std::chrono::duration_cast<std::chrono::microseconds>(clock.wall().time_since_epoch()).count();
    return concat(std::to_string(moment), ".", std::to_string(++notices), ".webots-session-server-",
                  std::to_string(port));
}

} // namespace webots_cloud
