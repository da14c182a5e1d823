// Decisions: core/refusals.
#include "run_compiler.hpp"

#include "async/cancellation.hpp"
#include "async/deadline.hpp"
#include "core/refusals.hpp"

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <limits>
#include <utility>
#include <variant>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr std::chrono::seconds compile_limit(30);
constexpr std::size_t most_printed = std::size_t{1} << 20; // bytes
constexpr std::size_t most_kept = 20'000; // bytes of what is printed: with escapes it fits into a message

/// Keeps the first of what a program prints.   Returns: how it ended.   Errors: `too_large`: it prints more
/// than `limit`, which costs time of everybody.
asio::awaitable<result<ExitStatus>> until_ended(Process& process, std::string& output, std::size_t limit)
{
    for (std::size_t read = 0; read <= limit;) {
        auto const event = co_await process.next_event();
        if (!event)
            co_return event.error();
        if (auto const* status = std::get_if<ExitStatus>(&*event))
            co_return *status;
        if (auto const* printed = std::get_if<ProcessOutput>(&*event)) {
            output.append(printed->bytes, 0, most_kept - std::min(most_kept, output.size()));
            read += printed->bytes.size();
        }
    }
    co_return Failure(errc::too_large);
}

} // namespace

asio::awaitable<Compilation> run_compiler(ProcessHost& processes, Clock& clock, ProcessSpec spec,
                                          std::string controller)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    Compilation compilation;
    auto const deadline = clock.now() + compile_limit;
    auto const process = co_await processes.start(std::move(spec));
    if (!process) {
        compilation.outcome = process.error();
        co_return compilation;
    }
    auto running = until_ended(**process, compilation.output, most_printed);
    auto const status = co_await async::with_deadline(clock, deadline, std::move(running));
    if (!status) { // it runs on, and would write into a folder that is about to be removed
        (*process)->terminate();
        auto ending = until_ended(**process, compilation.output, std::numeric_limits<std::size_t>::max());
        (void)co_await async::uncancellable(std::move(ending));
        compilation.outcome = status.error();
    }
    bool const failed = status ? *status != ExitStatus(0, false) : status.error() == errc::too_large;
    if (failed)
        compilation.outcome = core::refused(core::Refused::not_compiled, {{"controller", controller}});
    else if (!status && status.error() == errc::timed_out)
        compilation.outcome =
            core::refused(core::Refused::compiled_too_long,
                          {{"controller", controller}, {"seconds", std::to_string(compile_limit.count())}});
    co_return compilation;
}

} // namespace webots_cloud
