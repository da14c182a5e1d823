#include "docker_build_limits.hpp"

#include "async/cancellation.hpp"
#include "core/docker/build_limits.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// Until docker is followed anew, when it has ended.
constexpr auto between_attempts = std::chrono::seconds(10);

} // namespace

bool DockerBuildLimits::any() const
{
    return !core::limit_container(params_.limits, {}).empty();
}

asio::awaitable<result<>> DockerBuildLimits::run()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    for (;;) {
        co_await follow();
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return Failure(asio::error::operation_aborted);
        auto const waited = co_await clock_.wait_until(clock_.now() + between_attempts);
        if (!waited)
            co_return waited;
    }
}

/// Until docker ends.
asio::awaitable<void> DockerBuildLimits::follow()
{
    auto argv = core::watch_starts(params_.identity);
    argv.insert(argv.begin(), params_.docker.string());
    auto spec = commands_.spec(std::move(argv));
    auto const process = co_await processes_.start(std::move(spec));
    if (!process)
        co_return;
    core::LineSplitter lines;
    for (;;) {
        auto const event = co_await (*process)->next_event();
        auto const* output = event ? std::get_if<ProcessOutput>(&*event) : nullptr;
        if (!output)
            co_return;
        std::vector<std::string> started;
        auto const each = [&started](std::string_view line) {
            if (auto step = core::build_step(line))
                started.push_back(std::move(*step));
        };
        lines.feed(output->bytes, each);
        co_await limit(std::move(started));
    }
}

asio::awaitable<void> DockerBuildLimits::limit(std::vector<std::string> containers)
{
    for (auto const& container : containers) {
        auto arguments = core::limit_container(params_.limits, container);
        auto const limited = co_await commands_.docker(std::move(arguments));
        if (!limited) // as a step that has ended meanwhile
            log_.debug(concat("docker: a step of a build has no limits: ", limited.error().message()));
    }
}

} // namespace webots_cloud
