#include "guard_probe.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "async/deadline.hpp"
#include "core/text.hpp"
#include "spawn.hpp"

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/connect_pipe.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/readable_pipe.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/writable_pipe.hpp>
#include <boost/process/v2/process.hpp>

#include <fcntl.h>

#include <array>
#include <cerrno>
#include <csignal>

namespace webots_cloud::adapters {
namespace {

namespace asio = boost::asio;
namespace process = boost::process::v2;
using core::concat;

constexpr auto probe_patience = std::chrono::seconds(15); // of a machine that has much to do
constexpr std::size_t max_answer_size = 4096;

asio::awaitable<result<std::string>> read_all(asio::readable_pipe& output)
{
    std::string text;
    std::array<char, 512> buffer;
    while (text.size() < max_answer_size) {
        auto const [error, size] =
            co_await output.async_read_some(asio::buffer(buffer), asio::as_tuple(asio::use_awaitable));
        if (error == asio::error::eof)
            break;
        if (error)
            co_return Failure(error);
        text.append(buffer.data(), size);
    }
    co_return text;
}

} // namespace

asio::awaitable<result<std::string>> probe_guard(std::filesystem::path guard,
                                                 std::vector<std::filesystem::path> read_only, Clock& clock)
{
    auto const executor = co_await asio::this_coro::executor;
    boost::system::error_code error;
    asio::readable_pipe output(executor);
    asio::writable_pipe output_end(executor);
    asio::connect_pipe(output, output_end, error);
    FileDescriptor const nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    if (error || !nothing)
        co_return Failure(errc::start_failed, concat("no pipe: ", error.message()));
    Spawn spawn;
    spawn.program = guard.string();
    spawn.arguments.emplace_back("--probe");
    for (auto const& folder : read_only) {
        spawn.arguments.emplace_back("--read-only");
        spawn.arguments.push_back(folder.string());
    }
    spawn.input = nothing.get();
    spawn.output = output_end.native_handle();
    BlockingPool pool(1);
    auto const [failure, id] = co_await pool.run(std::move(spawn));
    if (failure != 0)
        co_return Failure(errc::start_failed,
                          concat(guard.string(), " can't be started: ",
                                 std::error_code(failure, std::generic_category()).message()));
    // Else our own end would keep the output open when the guard's is closed.
    output_end.close(error);
    process::process running(executor, id);
    auto answer = co_await async::with_deadline(clock, clock.now() + probe_patience, read_all(output));
    ::kill(id, SIGKILL); // it has said everything, or never will
    (void)co_await running.async_wait(asio::as_tuple(asio::use_awaitable));
    if (!answer)
        co_return answer.error().within(guard.string());
    co_return answer;
}

} // namespace webots_cloud::adapters
