#include "simulation_files.hpp"

#include "session_files.hpp"

namespace webots_cloud::core {

OwnFiles simulation_server_files(SimulationConfig const& config, SimulationFilesContext const& context)
{
    OwnFiles files;
    auto const system = folders_of_libraries();
    files.read.assign(system.begin(), system.end());
    for (auto const& file : {context.config_file, config.network.ssl_certificate, config.network.ssl_key,
                             config.access.operator_token_file, config.access.session_secret})
        if (!file.empty())
            files.read.push_back(file.parent_path());
    if (!config.network.challenge_folder.empty())
        files.read.push_back(config.network.challenge_folder);
    for (auto const& forge : config.forges)
        if (!forge.directory.empty())
            files.read.push_back(forge.directory);
    if (config.docker) {
        files.read.push_back(config.containers.directory);
    } else {
        files.read.push_back(config.key_dir);
        files.read.push_back(context.templates);
    }
    // Not the folder that holds the directories of simulations: what is in there is used by root's programs.
    files.write = {config.log_dir, context.socket.parent_path(), context.instances, context.caches,
                   "/dev/null"};
    files.tidy = context.groups;
    files.moves_files = true; // into the cache
    files.signals = true;     // guards that somebody has stopped are woken
    return files;
}

} // namespace webots_cloud::core
