// Docker has no option for the limits of a build's steps, so they are set on the containers as they appear,
// and what they write is measured at intervals. Between appearing and limiting there is a moment without.
#include "docker_build_limits.hpp"

#include "async/cancellation.hpp"
#include "async/first_of.hpp"
#include "core/docker/build_limits.hpp"
#include "core/simulation/webots_output.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// Until docker is followed anew, when it has ended.
constexpr auto between_attempts = std::chrono::seconds(10);
// Between looks at what steps have written; more where docker takes long to count it.
constexpr auto between_looks = std::chrono::seconds(2);

} // namespace

void DockerBuildLimits::begin(std::string project)
{
    if (core::limit_container(params_.limits, {}).empty() && params_.limits.disk == 0)
        return;
    projects_[std::move(project)] = clock_.wall();
    if (begun_)
        begun_->notify();
}

void DockerBuildLimits::end(std::string const& project) noexcept
{
    projects_.erase(project);
    if (projects_.empty() && following_)
        following_->terminate();
}

asio::awaitable<result<>> DockerBuildLimits::run()
{
    if (params_.limits.disk == 0)
        co_return co_await keep_following();
    auto parts = async::first_of(keep_following(), keep_measuring());
    co_return co_await std::move(parts);
}

asio::awaitable<result<>> DockerBuildLimits::keep_following()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    begun_.emplace(co_await asio::this_coro::executor);
    for (;;) {
        bool const cancelled = co_await async::is_cancelled();
        if (cancelled)
            co_return Failure(asio::error::operation_aborted);
        if (projects_.empty()) {
            auto const begun = co_await begun_->wait();
            if (!begun)
                co_return begun;
            continue;
        }
        co_await follow();
        if (projects_.empty())
            continue;
        auto const waited = co_await clock_.wait_until(clock_.now() + between_attempts);
        if (!waited)
            co_return waited;
    }
}

/// Until docker ends, or is not needed any more.
asio::awaitable<void> DockerBuildLimits::follow()
{
    auto argv = core::watch_starts(params_.identity, projects_.begin()->second);
    argv.insert(argv.begin(), params_.docker.string());
    auto spec = commands_.spec(std::move(argv));
    auto process = co_await processes_.start(std::move(spec));
    if (!process)
        co_return;
    following_ = std::move(*process);
    if (projects_.empty())
        following_->terminate();
    core::LineSplitter lines;
    for (;;) {
        auto const event = co_await following_->next_event();
        auto const* output = event ? std::get_if<ProcessOutput>(&*event) : nullptr;
        if (!output)
            break;
        std::vector<std::string> started;
        auto const each = [&started](std::string_view line) {
            if (auto step = core::build_step(line))
                started.push_back(std::move(*step));
        };
        lines.feed(output->bytes, each);
        co_await limit(std::move(started));
    }
    following_.reset();
}

asio::awaitable<void> DockerBuildLimits::limit(std::vector<std::string> containers)
{
    if (params_.limits.disk != 0)
        steps_.insert(containers.begin(), containers.end());
    for (auto const& container : containers) {
        auto arguments = core::limit_container(params_.limits, container);
        if (arguments.empty())
            continue;
        auto const limited = co_await commands_.docker(std::move(arguments));
        if (!limited) // as a step that has ended meanwhile
            log_.debug(concat("docker: a step of a build has no limits: ", limited.error().message()));
    }
}

asio::awaitable<result<>> DockerBuildLimits::keep_measuring()
{
    co_await asio::this_coro::throw_if_cancelled(false);
    Duration counted{};
    for (;;) {
        auto const pause = std::max<Duration>(between_looks, 10 * counted);
        auto const waited = co_await clock_.wait_until(clock_.now() + pause);
        bool const cancelled = co_await async::is_cancelled(); // commands are not cancellable
        if (!waited || cancelled)
            co_return Failure(asio::error::operation_aborted);
        auto const began = clock_.now();
        if (!steps_.empty())
            co_await measure();
        counted = clock_.now() - began;
    }
}

asio::awaitable<void> DockerBuildLimits::measure()
{
    auto const looked_at = steps_; // more may come meanwhile
    auto list = core::list_step_sizes(looked_at);
    auto const listing = co_await commands_.docker(std::move(list));
    if (!listing)
        co_return;
    auto const sizes = core::read_step_sizes(*listing);
    for (auto const& step : looked_at) {
        auto const size = sizes.find(step);
        bool const runs = size != sizes.end();
        if (runs && size->second <= params_.limits.disk)
            continue;
        steps_.erase(step);
        if (!runs)
            continue;
        log_.warning(LogCause("build"),
                     concat("docker: a step of a build is killed, since it has written more than ",
                            std::to_string(params_.limits.disk / 1'000'000), " MB"));
        std::vector<std::string> kill{"kill", step};
        (void)co_await commands_.docker(std::move(kill)); // it may have ended meanwhile
    }
}

} // namespace webots_cloud
