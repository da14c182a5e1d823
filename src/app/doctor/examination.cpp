#include "examination.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/experimental/awaitable_operators.hpp>

#include <exception>
#include <iterator>
#include <utility>

namespace webots_cloud::app {
namespace asio = boost::asio;
using namespace asio::experimental::awaitable_operators;

namespace {

/// What the coroutines of one examination share.
struct RunningChecks
{
    std::vector<Check> checks;
    std::vector<core::Findings> found; ///< As `checks`.
    std::vector<bool> done;            ///< As `checks`.
    Clock& clock;
    Progress progress;
};

asio::awaitable<void> examine_one(RunningChecks& all, std::size_t index)
{
    auto& check = all.checks[index];
    auto outcome = co_await (std::move(check.work) || all.clock.wait_until(all.clock.now() + check.limit));
    if (outcome.index() == 0)
        all.found[index] = std::move(std::get<0>(outcome));
    else
        all.found[index].emplace_back(
            core::Verdict::warning, check.subject,
            core::concat("nothing was found out within ", core::seconds_text(check.limit), " s"),
            "What was asked hangs, or is very slow: look again later.");
    all.done[index] = true;
}

/// One after the other would take as long as all together.
asio::awaitable<void> examine_from(RunningChecks& all, std::size_t index)
{
    if (index == all.checks.size())
        co_return;
    co_await (examine_one(all, index) && examine_from(all, index + 1));
}

asio::awaitable<void> tell_progress(RunningChecks const& all)
{
    for (;;) {
        auto const waited = co_await all.clock.wait_until(all.clock.now() + std::chrono::seconds(1));
        if (!waited)
            co_return;
        std::vector<std::string> pending;
        for (std::size_t i = 0; i < all.checks.size(); ++i)
            if (!all.done[i])
                pending.push_back(all.checks[i].subject);
        if (all.progress)
            all.progress(pending);
    }
}

} // namespace

asio::awaitable<core::Findings> examine(std::vector<Check> checks, Clock& clock, Progress progress)
{
    auto const count = checks.size();
    RunningChecks all{std::move(checks), std::vector<core::Findings>(count), std::vector<bool>(count), clock,
                      std::move(progress)};
    co_await (examine_from(all, 0) || tell_progress(all));
    core::Findings findings;
    for (auto& each : all.found)
        findings.insert(findings.end(), std::make_move_iterator(each.begin()),
                        std::make_move_iterator(each.end()));
    co_return findings;
}

void run_to_end(asio::awaitable<core::Findings> work, asio::io_context& context, core::Findings& findings)
{
    auto const take = [&findings](std::exception_ptr failure, core::Findings const& found) {
        if (failure)
            std::rethrow_exception(failure);
        findings.insert(findings.end(), found.begin(), found.end());
    };
    asio::co_spawn(context, std::move(work), take);
    context.run();
}

} // namespace webots_cloud::app
