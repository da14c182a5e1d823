#include <webots_cloud/registration.hpp>

#include "../async/cancellation.hpp"
#include "../async/task_group.hpp"
#include "../core/registration_form.hpp"
#include "../core/text.hpp"
#include "../core/web_form.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

constexpr auto first_pause = std::chrono::seconds(5);
constexpr auto longest_pause = std::chrono::minutes(10);

} // namespace

asio::awaitable<result<>> Registration::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    async::TaskGroup tasks(executor);
    for (auto const& registry : params_.registries)
        tasks.spawn(register_at(registry));
    async::Wakeup forever(executor);
    (void)co_await forever.wait();
    tasks.cancel_all();
    co_await asio::this_coro::reset_cancellation_state(asio::disable_cancellation());
    co_await tasks.join();
    co_return Failure(asio::error::operation_aborted);
}

asio::awaitable<void> Registration::register_at(std::string registry)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    Duration pause = first_pause;
    for (;;) {
        HttpRequest request(registry);
        request.method = "POST";
        request.headers.emplace_back("Content-Type", std::string(core::form_type));
        request.body = core::registration_form(params_.url, params_.share_idle_time, params_.allowed_repositories);
        request.timeout = std::chrono::seconds(10);
        auto const answer = co_await http_.send(std::move(request));
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return;
        if (answer && answer->status == 200) {
            log_.info(concat("Registered at ", registry, ": ", core::printable(core::trim(answer->body))));
            co_return;
        }
        auto const why = answer ? concat("HTTP ", std::to_string(answer->status)) : answer.error().message();
        log_.warning(concat("Could not register at ", registry, ": ", why, "; trying again in ",
                            std::to_string(std::chrono::duration_cast<std::chrono::seconds>(pause).count()), " s"));
        auto const waited = co_await clock_.wait_until(clock_.now() + pause);
        bool const cancelled_meanwhile = co_await async::is_cancelled();
        if (!waited || cancelled_meanwhile)
            co_return;
        pause = std::min<Duration>(2 * pause, longest_pause);
    }
}

} // namespace webots_cloud
