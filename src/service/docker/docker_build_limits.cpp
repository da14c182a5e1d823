// Docker has no option for the limits of a build's steps, so they are set on the containers as they appear,
// and there is a moment without. What they write is counted with the rest of their build (docker_mode.cpp).
// Decisions: core/docker/build_limits.
#include "docker_build_limits.hpp"

#include "async/cancellation.hpp"
#include "core/docker/build_limits.hpp"
#include "core/simulation/webots_output.hpp"
#include "core/text.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// Until docker is followed anew, when it has ended.
constexpr auto between_attempts = std::chrono::seconds(10);

} // namespace

void DockerBuildLimits::begin(std::string project)
{
    if (core::limit_container(facts_.limits, {}).empty())
        return;
    projects_[std::move(project)] = clock_.wall();
    if (begun_)
        begun_->notify();
}

void DockerBuildLimits::end(std::string const& project) noexcept
{
    projects_.erase(project);
    if (projects_.empty() && following_) {
        is_ending_ = true;
        following_->terminate();
    }
}

asio::awaitable<result<>> DockerBuildLimits::run()
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
        // It was ended by us, and the next build may have begun meanwhile.
        if (std::exchange(is_ending_, false) || projects_.empty())
            continue;
        // Docker has ended by itself, and may be down: it is not asked again without a pause.
        auto const waited = co_await clock_.wait_until(clock_.now() + between_attempts);
        if (!waited)
            co_return waited;
    }
}

/// Until docker ends, or is not needed any more.
asio::awaitable<void> DockerBuildLimits::follow()
{
    // Docker first prints what has started since then: steps that were faster than we are limited as well.
    auto const began_earlier = [](auto const& left, auto const& right) { return left.second < right.second; };
    auto const first = std::min_element(projects_.begin(), projects_.end(), began_earlier);
    auto argv = core::watch_starts(facts_.identity, first->second);
    argv.insert(argv.begin(), facts_.docker.string());
    auto spec = commands_.spec(std::move(argv));
    auto process = co_await processes_.start(std::move(spec));
    if (!process)
        co_return;
    following_ = std::move(*process);
    // The last build may have ended while docker was being started, when `end` had nothing to terminate.
    if (projects_.empty()) {
        is_ending_ = true;
        following_->terminate();
    }
    core::LineSplitter lines;
    for (;;) {
        auto const event = co_await following_->next_event();
        auto const* output = event ? std::get_if<ProcessOutput>(&*event) : nullptr;
        if (!output)
            break;
        // Collected first: to limit one takes a command, and a line's handler can't wait.
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
    for (auto const& container : containers) {
        auto arguments = core::limit_container(facts_.limits, container);
        if (arguments.empty())
            continue;
        auto const limited = co_await commands_.docker(std::move(arguments));
        if (!limited) // as a step that has ended meanwhile
            log_.debug(concat("docker: a step of a build has no limits: ", limited.error().message()));
    }
}

} // namespace webots_cloud
