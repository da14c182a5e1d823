#include "simulation_files.hpp"

#include "session_files.hpp"

namespace webots_cloud::core {

OwnFiles simulation_server_files(SimulationConfig const& config, SimulationFilesContext const& context)
{
    OwnFiles files;
    files.read = read_by_each_server(context.config_file, config.network, config.access);
    for (auto const& forge : config.forges)
        if (!forge.is_server()) // what comes from servers is in `caches`
            files.read.push_back(forge.directory);
    if (!config.http_client.authorities.empty())
        files.read.push_back(config.http_client.authorities.parent_path());
    if (config.docker) {
        files.read.push_back(config.containers.directory);
    } else {
        files.read.push_back(config.websites.keys);
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
