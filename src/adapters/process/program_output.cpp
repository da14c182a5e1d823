#include "program_output.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "core/text.hpp"
#include "spawn.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <system_error>
#include <utility>

namespace webots_cloud::adapters {
namespace {

using core::concat;

constexpr std::size_t max_printed = std::size_t{1} << 20; // what follows is read and forgotten

std::string error_text(int number)
{
    return std::error_code(number, std::generic_category()).message();
}

} // namespace

result<ProgramEnd> run_program(std::vector<std::string> const& command, Duration limit)
{
    std::array<int, 2> ends{-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0)
        return Failure(errc::start_failed, concat("no pipe: ", error_text(errno)));
    FileDescriptor const output_end(ends[0]);
    FileDescriptor input_end(ends[1]);
    FileDescriptor const nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    Spawn spawn;
    spawn.program = command.front();
    spawn.arguments.assign(command.begin() + 1, command.end());
    for (char** variable = environ; *variable; ++variable)
        spawn.environment.emplace_back(*variable);
    spawn.input = nothing.get();
    spawn.output = input_end.get();
    auto const [failure, process] = spawn();
    if (failure != 0)
        return Failure(errc::start_failed,
                       concat(command.front(), " can't be started: ", error_text(failure)));
    // Else our own end would keep the output open when the program's is closed.
    input_end = FileDescriptor();
    auto ended = await_end(process, output_end.get(), max_printed,
                           std::chrono::ceil<std::chrono::milliseconds>(limit));
    if (!ended.in_time)
        return Failure(errc::timed_out, concat(command.front(), " has not ended in time"));
    constexpr int of_signals = 128; // as shells do
    ProgramEnd end;
    end.output = std::move(ended.output);
    end.status = WIFEXITED(ended.status) ? WEXITSTATUS(ended.status) : of_signals + WTERMSIG(ended.status);
    return end;
}

result<std::string> program_output(std::vector<std::string> const& command, Duration limit)
{
    auto end = run_program(command, limit);
    if (!end)
        return end.error();
    if (end->status != 0)
        return Failure(errc::start_failed, core::printable(core::trim(end->output), 300));
    return std::move(end->output);
}

} // namespace webots_cloud::adapters
