// Decisions: core/discovery/announcements.
#include <webots_cloud/announcing.hpp>

#include "async/cancellation.hpp"
#include "async/task_group.hpp"
#include "core/discovery/announcements.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <optional>
#include <unordered_map>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// Shorter than `core::announcement_interval`, so that a session server that does not answer is asked again on
// time.
constexpr Duration announcement_timeout = std::chrono::seconds(8);
// The end of our server waits for goodbyes.
constexpr Duration goodbye_timeout = std::chrono::seconds(2);

} // namespace

struct Announcing::Impl
{
    HttpRequest request(std::string const& session_server, bool is_goodbye);
    asio::awaitable<result<HttpResponse>> announce(std::string const& session_server);
    asio::awaitable<void> keep_announcing(std::string session_server);
    asio::awaitable<void> say_goodbye(std::string session_server);
    asio::awaitable<result<>> run();

    std::vector<std::string> const session_servers;
    std::string const address;
    HttpClient& http;
    Clock& clock;
    Logger log;
    std::function<std::string(std::string_view)> mac;
    std::unordered_map<std::string, std::string> receivers{}; ///< What session servers call themselves.
    WallTime last{}; ///< When the last one was signed: each has to be later than that before.
};

Announcing::Announcing(std::vector<std::string> session_servers, std::string address, HttpClient& http,
                       Clock& clock, Logger log, std::function<std::string(std::string_view message)> mac)
    : impl_(new Impl{std::move(session_servers), std::move(address), http, clock, std::move(log),
                     std::move(mac)})
{}

Announcing::~Announcing() = default;

asio::awaitable<result<>> Announcing::run()
{
    return impl_->run();
}

HttpRequest Announcing::Impl::request(std::string const& session_server, bool is_goodbye)
{
    core::Announcement announcement;
    announcement.machine = address;
    last = std::max(clock.wall(), last + std::chrono::milliseconds(1));
    announcement.at = last;
    announcement.receiver = receivers[session_server];
    announcement.is_goodbye = is_goodbye;
    auto const query = core::announcement_query(announcement);
    HttpRequest post(concat(session_server, core::announcement_path, "?", query));
    post.method = "POST";
    post.headers.emplace_back("Authorization", core::sign_announcement(mac, query));
    post.timeout = is_goodbye ? goodbye_timeout : announcement_timeout;
    return post;
}

/// Once more, where the session server says that it is another one than before.
asio::awaitable<result<HttpResponse>> Announcing::Impl::announce(std::string const& session_server)
{
    auto answer = co_await http.send(request(session_server, false));
    bool const cancelled = co_await async::is_cancelled();
    if (cancelled || !answer || answer->status != 421)
        co_return answer;
    auto receiver = core::parse_receiver_answer(answer->body);
    if (!receiver)
        co_return answer;
    // It has started anew, or is heard for the first time: it takes only what is signed for it in this run,
    // so that nobody can replay there what was sent to another one.
    receivers[session_server] = std::move(*receiver);
    answer = co_await http.send(request(session_server, false));
    co_return answer;
}

asio::awaitable<void> Announcing::Impl::keep_announcing(std::string session_server)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    std::optional<std::string> problem; // of the last announcement: empty: none; not set: there was none
    for (;;) {
        // Counted from here, so that a slow answer does not delay the next announcement as well.
        auto const next = clock.now() + core::announcement_interval;
        auto const answer = co_await announce(session_server);
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return;
        std::string now;
        if (!answer)
            now = answer.error().message();
        else if (answer->status != 200)
            now = concat("HTTP ", std::to_string(answer->status), ": ",
                         core::printable(core::trim(answer->body), 200));
        // Only what is new is logged: a session server that is down for a night would fill the log.
        if (problem != now && now.empty())
            log.info(concat("Announced to ", session_server));
        else if (problem != now)
            log.warning(concat("Could not announce this server to ", session_server, ": ", now,
                               "; it is tried again every ten seconds"));
        problem = std::move(now);
        auto const waited = co_await clock.wait_until(next);
        bool const cancelled_meanwhile = co_await async::is_cancelled();
        if (!waited || cancelled_meanwhile)
            co_return;
    }
}

asio::awaitable<void> Announcing::Impl::say_goodbye(std::string session_server)
{
    (void)co_await http.send(request(session_server, true)); // otherwise we are forgotten half a minute later
}

asio::awaitable<result<>> Announcing::Impl::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    async::TaskGroup tasks(co_await asio::this_coro::executor);
    for (auto const& session_server : session_servers)
        tasks.spawn(keep_announcing(session_server));
    auto const ended = co_await async::until_cancelled();
    // First no announcement may be under way any more: one that arrives after our goodbye would bring us
    // back.
    co_await tasks.end();
    for (auto const& session_server : session_servers)
        tasks.spawn(say_goodbye(session_server));
    // We have been cancelled already, which would end each goodbye before it is sent.
    co_await async::uncancellable(tasks.join());
    co_return ended;
}

} // namespace webots_cloud
