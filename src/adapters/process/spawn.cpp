#include "spawn.hpp"

#include "adapters/files/file_descriptor.hpp"

#include <spawn.h>
#include <sys/poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>

namespace webots_cloud::adapters {
namespace {

std::vector<char*> pointers(std::string const* first, std::vector<std::string> const& texts)
{
    std::vector<char*> all;
    if (first)
        all.push_back(const_cast<char*>(first->c_str()));
    for (auto const& text : texts)
        all.push_back(const_cast<char*>(text.c_str()));
    all.push_back(nullptr);
    return all;
}

using Deadline = std::chrono::steady_clock::time_point;

/// Waits for something to be read, or an end.   False: there was nothing until the deadline.
bool await_input(int descriptor, Deadline deadline)
{
    using std::chrono::milliseconds;
    for (;;) {
        auto const left = std::chrono::ceil<milliseconds>(deadline - std::chrono::steady_clock::now());
        pollfd readable{descriptor, POLLIN, 0};
        int const ready = left.count() > 0 ? ::poll(&readable, 1, static_cast<int>(left.count())) : 0;
        if (ready >= 0 || errno != EINTR)
            return ready > 0;
    }
}

/// Until the other end is closed.   False: that was not before the deadline.
bool read_all(int from, std::string& output, std::size_t most, Deadline deadline)
{
    std::array<char, 4096> buffer;
    while (await_input(from, deadline)) {
        auto const size = ::read(from, buffer.data(), buffer.size());
        if (size <= 0)
            return true;
        auto const wanted = std::min(static_cast<std::size_t>(size), most - std::min(most, output.size()));
        output.append(buffer.data(), wanted);
    }
    return false;
}

} // namespace

std::pair<int, pid_t> Spawn::operator()() const
{
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
    // The guard gets a user namespace as descriptor 3, and nothing else of ours.
    int const first_closed = users < 0 ? STDERR_FILENO + 1 : STDERR_FILENO + 2;
    if (users >= 0)
        posix_spawn_file_actions_adddup2(&actions, users, STDERR_FILENO + 1);
    posix_spawn_file_actions_addclosefrom_np(&actions, first_closed);
    if (!directory.empty())
        posix_spawn_file_actions_addchdir_np(&actions, directory.c_str());
    pid_t process = -1;
    int const error =
        posix_spawn(&process, program.c_str(), &actions, nullptr, pointers(&program, arguments).data(),
                    pointers(nullptr, environment).data());
    posix_spawn_file_actions_destroy(&actions);
    return {error, process};
}

SpawnEnd await_end(pid_t process, int output, std::size_t most, std::chrono::milliseconds limit)
{
    auto const deadline = std::chrono::steady_clock::now() + limit;
    FileDescriptor const ended(static_cast<int>(::syscall(SYS_pidfd_open, process, 0)));
    SpawnEnd end;
    end.in_time = read_all(output, end.output, most, deadline) &&
                  (ended.get() < 0 || await_input(ended.get(), deadline));
    if (!end.in_time)
        ::kill(process, SIGKILL);
    while (::waitpid(process, &end.status, 0) < 0 && errno == EINTR)
        continue;
    return end;
}

} // namespace webots_cloud::adapters
