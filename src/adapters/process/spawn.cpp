#include "spawn.hpp"

#include <spawn.h>
#include <unistd.h>

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

} // namespace webots_cloud::adapters
