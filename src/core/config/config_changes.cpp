#include "config_changes.hpp"

#include <utility>

namespace webots_cloud::core {
namespace {

/// Keys whose values differ.
class Changes
{
public:
    template<class Value>
    void compare(std::string_view key, Value const& running, Value const& next)
    {
        if (!(running == next))
            keys_.push_back(key);
    }

    /// The keys of both servers.
    template<class Config>
    void compare_common(Config const& running, Config const& next)
    {
        compare("port", running.address.port, next.address.port);
        compare("sslCertificate", running.network.ssl_certificate, next.network.ssl_certificate);
        compare("sslKey", running.network.ssl_key, next.network.ssl_key);
        compare("redirectPort", running.network.redirect_port, next.network.redirect_port);
        compare("challengeFolder", running.network.challenge_folder, next.network.challenge_folder);
        compare("listenAddress", running.network.listen_address, next.network.listen_address);
        compare("connectionsPerAddress", running.network.connections_per_address,
                next.network.connections_per_address);
        compare("pingTimeout", running.network.ping_timeout, next.network.ping_timeout);
        compare("sessionSecret", running.access.session_secret, next.access.session_secret);
        compare("operatorSocket", running.access.operator_socket, next.access.operator_socket);
        compare("trustedProxies", running.network.trusted_proxies, next.network.trusted_proxies);
        compare("logDir", running.log_dir, next.log_dir);
        compare("debug", running.debug, next.debug);
        compare("logFormat", running.json_log, next.json_log);
    }

    std::vector<std::string_view> take() { return std::move(keys_); }

private:
    std::vector<std::string_view> keys_;
};

} // namespace

std::vector<std::string_view> keys_for_restart(SessionConfig const& running, SessionConfig const& next)
{
    Changes changes;
    changes.compare_common(running, next);
    changes.compare("announcements", running.announcements, next.announcements);
    changes.compare("nameServers", running.name_servers, next.name_servers);
    changes.compare("caFile", running.ca_file, next.ca_file);
    changes.compare("placementTimeout", running.placement_timeout, next.placement_timeout);
    return changes.take();
}

std::vector<std::string_view> keys_for_restart(SimulationConfig const& running, SimulationConfig const& next)
{
    Changes changes;
    changes.compare_common(running, next);
    changes.compare("server", running.address.host, next.address.host);
    changes.compare("ssl", running.address.ssl, next.address.ssl);
    changes.compare("portRewrite", running.address.port_rewrite, next.address.port_rewrite);
    changes.compare("launcher", running.slurm, next.slurm);
    changes.compare("docker", running.docker, next.docker);
    auto const& docker = running.containers;
    changes.compare("dockerDir", docker.directory, next.containers.directory);
    changes.compare("dockerImages", docker.images, next.containers.images);
    changes.compare("projectDockerfiles", docker.project_dockerfiles, next.containers.project_dockerfiles);
    changes.compare("persistantDockerImages", docker.persistent_images, next.containers.persistent_images);
    changes.compare("forges", running.forges, next.forges);
    changes.compare("caFile", running.ca_file, next.ca_file);
    changes.compare("notify", running.notify, next.notify);
    changes.compare("sessionServers", running.session_servers, next.session_servers);
    changes.compare("cacheSize", running.cache_bytes, next.cache_bytes);
    changes.compare("stateDir", running.state_dir, next.state_dir);
    changes.compare("fetchMemory", running.fetch_memory, next.fetch_memory);
    changes.compare("fetchDisk", running.fetch_disk, next.fetch_disk);
    changes.compare("webotsHome", running.webots_home, next.webots_home);
    changes.compare("labels", running.labels, next.labels);
    changes.compare("display", running.display, next.display);
    changes.compare("sandbox", running.sandbox, next.sandbox);
    changes.compare("simulationUser", running.simulation_user, next.simulation_user);
    changes.compare("confineServer", running.confine_server, next.confine_server);
    changes.compare("network", running.network_reach, next.network_reach);
    changes.compare("simulationMemory", running.limits.memory, next.limits.memory);
    changes.compare("simulationCpus", running.limits.processors, next.limits.processors);
    changes.compare("simulationProcesses", running.limits.processes, next.limits.processes);
    changes.compare("simulationFiles", running.limits.files, next.limits.files);
    changes.compare("simulationDisk", running.limits.disk, next.limits.disk);
    changes.compare("gateway", running.gateway, next.gateway);
    changes.compare("simulatorEnvironment", running.simulator_environment, next.simulator_environment);
    changes.compare("maxConnections", running.max_connections, next.max_connections);
    changes.compare("timeout", running.timeout, next.timeout);
    changes.compare("extendable", running.extendable, next.extendable);
    changes.compare("startTimeout", running.start_timeout, next.start_timeout);
    changes.compare("reconnectGrace", std::pair(running.reconnect_grace, running.return_grace),
                    std::pair(next.reconnect_grace, next.return_grace));
    changes.compare("projectsDir", running.projects_dir, next.projects_dir);
    changes.compare("keyDir", running.key_dir, next.key_dir);
    changes.compare("multimediaServer", running.multimedia_server, next.multimedia_server);
    changes.compare("multimediaStream", running.multimedia_stream, next.multimedia_stream);
    changes.compare("simulationLogDays", running.simulation_log_keep, next.simulation_log_keep);
    changes.compare("monitorLogEnabled", running.monitor_log, next.monitor_log);
    changes.compare("loadFormula", running.strict_load, next.strict_load);
    return changes.take();
}

} // namespace webots_cloud::core
