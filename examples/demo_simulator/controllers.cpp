#include "controllers.hpp"

#include "console.hpp"

#include <sys/types.h>

#include <spawn.h>
#include <unistd.h>

#include <cstring>
#include <string>

namespace webots_cloud::demo {
namespace {

namespace fs = std::filesystem;

bool is_plain_name(std::string const& name)
{
    return !name.empty() && name.find('/') == std::string::npos && name != "." && name != "..";
}

void start(std::string const& name, fs::path const& folder)
{
    auto program = (folder / name).string();
    std::error_code error;
    if (!fs::is_regular_file(program, error) || ::access(program.c_str(), X_OK) != 0)
        return;
    char* const arguments[] = {program.data(), nullptr};
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    pid_t id = 0;
    int const failed = ::posix_spawn(&id, program.c_str(), &actions, nullptr, arguments, environ);
    ::posix_spawn_file_actions_destroy(&actions);
    print_line(failed == 0 ? "INFO: " + name + ": starting controller"
                           : "ERROR: " + name + ": can't be started: " + std::strerror(failed));
}

} // namespace

void start_controllers(World const& world, fs::path const& world_file)
{
    auto const folder = world_file.parent_path().parent_path() / "controllers";
    for (auto const& name : world.controllers)
        if (is_plain_name(name))
            start(name, folder / name);
}

} // namespace webots_cloud::demo
