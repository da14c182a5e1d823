// Decisions: core/notices/registration_form.
#include <webots_cloud/registration.hpp>

#include "async/cancellation.hpp"
#include "async/task_group.hpp"
#include "core/notices/registration_form.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"
#include "core/web_form.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <optional>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// After a failure; doubled after each that follows.
constexpr auto first_pause = std::chrono::seconds(5);
constexpr auto max_pause = std::chrono::minutes(10);

} // namespace

struct Registration::Impl
{
    Impl(SimulationServiceConfig const& config, std::string own_url, HttpClient& client, Clock& time,
         Logger logger)
        : registries(config.notify), url(std::move(own_url)), repositories(config.repositories), http(client),
          clock(time), log(std::move(logger))
    {}

    std::string form() const
    {
        return core::registration_form(url, repositories.share_idle_time, repositories.allowed);
    }

    asio::awaitable<void> register_at(std::string registry);

    std::vector<std::string> const registries;
    std::string const url;
    RepositoryRules repositories;
    HttpClient& http;
    Clock& clock;
    Logger log;
    std::optional<async::Wakeup> changed; ///< There while it runs.
};

Registration::Registration(SimulationServiceConfig const& config, std::string url, HttpClient& http,
                           Clock& clock, Logger log)
    : impl_(std::make_unique<Impl>(config, std::move(url), http, clock, std::move(log)))
{}

Registration::~Registration() = default;

void Registration::apply(SimulationServiceConfig const& config)
{
    auto const known = impl_->form();
    impl_->repositories = config.repositories;
    if (impl_->changed && impl_->form() != known)
        impl_->changed->notify();
}

asio::awaitable<result<>> Registration::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    async::TaskGroup tasks(executor);
    impl_->changed.emplace(executor);
    bool running = true;
    while (running) {
        for (auto const& registry : impl_->registries)
            tasks.spawn(impl_->register_at(registry));
        // A registry keeps what it was told last. Once the repositories have changed (`apply`), attempts that
        // still go on would tell it what was before.
        auto const changed = co_await impl_->changed->wait();
        tasks.cancel_all();
        bool const cancelled = co_await async::is_cancelled();
        running = changed && !cancelled;
    }
    co_await tasks.end();
    impl_->changed.reset();
    co_return Failure(asio::error::operation_aborted);
}

asio::awaitable<void> Registration::Impl::register_at(std::string registry)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    Duration pause = first_pause;
    for (;;) {
        HttpRequest request(registry);
        request.method = "POST";
        request.headers.emplace_back("Content-Type", std::string(core::form_type));
        request.body = form();
        request.timeout = std::chrono::seconds(10);
        auto const answer = co_await http.send(std::move(request));
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return;
        if (answer && answer->status / 100 == 2) {
            log.info(concat("Registered at ", registry, ": ", core::printable(core::trim(answer->body))));
            co_return;
        }
        auto const why = answer ? concat("HTTP ", std::to_string(answer->status)) : answer.error().message();
        log.warning(concat("Could not register at ", registry, ": ", why, "; trying again in ",
                           core::seconds_text(pause), " s"));
        auto const waited = co_await clock.wait_until(clock.now() + pause);
        bool const cancelled_meanwhile = co_await async::is_cancelled();
        if (!waited || cancelled_meanwhile)
            co_return;
        // A registry that is down for days is asked less and less often.
        pause = std::min<Duration>(2 * pause, max_pause);
    }
}

} // namespace webots_cloud
