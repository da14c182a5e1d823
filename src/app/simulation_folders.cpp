#include "simulation_folders.hpp"

#include "environment.hpp"

#include <unistd.h>

namespace webots_cloud::app {

namespace fs = std::filesystem;

fs::path cache_folder(SimulationConfig const& config)
{
    auto base = fs::path(environment("XDG_CACHE_HOME"));
    if (base.empty() && !environment("HOME").empty())
        base = fs::path(environment("HOME")) / ".cache";
    if (base.empty())
        base = temporary_folder();
    return base / "webots_cloud" / std::to_string(config.address.port);
}

std::vector<core::StateFolder> state_folders(SimulationConfig const& config)
{
    core::StateFolderContext context;
    context.configured = absolute_path(config.state_dir);
    context.state_directory = environment("STATE_DIRECTORY");
    context.xdg_state_home = environment("XDG_STATE_HOME");
    context.home = environment("HOME");
    context.temporary = temporary_folder();
    context.user = ::getuid();
    return core::state_folders(context);
}

} // namespace webots_cloud::app
