#include "simulation_folders.hpp"

#include "environment.hpp"

#include <unistd.h>

namespace webots_cloud::app {

namespace fs = std::filesystem;

namespace {

core::StateFolderContext folder_context(SimulationConfig const& config)
{
    core::StateFolderContext context;
    context.configured = absolute_path(config.state_dir);
    context.state_directory = environment("STATE_DIRECTORY");
    context.xdg_state_home = environment("XDG_STATE_HOME");
    context.xdg_cache_home = environment("XDG_CACHE_HOME");
    context.home = environment("HOME");
    context.temporary = temporary_folder();
    context.user = ::getuid();
    return context;
}

} // namespace

fs::path cache_folder(SimulationConfig const& config, fs::path const& state)
{
    return core::cache_folder(folder_context(config), state) / std::to_string(config.address.port);
}

fs::path spare_cache_folder(SimulationConfig const& config, fs::path const& state)
{
    return core::spare_cache_folder(state) / std::to_string(config.address.port);
}

std::vector<core::StateFolder> state_folders(SimulationConfig const& config)
{
    return core::state_folders(folder_context(config));
}

} // namespace webots_cloud::app
