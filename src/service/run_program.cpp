// Decisions: core/simulation/last_words.
#include "run_program.hpp"

#include "async/deadline.hpp"
#include "core/simulation/last_words.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

// Bytes that are kept. The rest is read as well, so that the program does not wait for us.
constexpr std::size_t max_output = std::size_t{4} << 20;

} // namespace

asio::awaitable<result<std::string>> run_program(ProcessHost& processes, Clock& clock, ProcessSpec spec,
                                                 Duration limit)
{
    auto const name = spec.argv.front();
    auto const deadline = clock.now() + limit;
    auto const process = co_await processes.start(std::move(spec));
    if (!process)
        co_return process.error();
    std::string output;
    for (;;) {
        auto const event = co_await async::with_deadline(clock, deadline, (*process)->next_event());
        if (!event)
            co_return event.error().within(name);
        if (auto const* status = std::get_if<ExitStatus>(&*event)) {
            if (*status == ExitStatus(0, false))
                co_return output;
            auto reason = core::printable(core::last_words(output), 300);
            co_return Failure(errc::start_failed,
                              reason.empty() ? core::concat(name, " has failed") : std::move(reason));
        }
        if (auto const* printed = std::get_if<ProcessOutput>(&*event))
            output.append(printed->bytes, 0, max_output - std::min(max_output, output.size()));
    }
}

} // namespace webots_cloud
