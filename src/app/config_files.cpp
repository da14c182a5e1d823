#include "core/docker/docker_project.hpp"
#include "core/simulation/simulator_choice.hpp"
#include "core/text.hpp"
#include "environment.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/daemon.hpp>

#include <filesystem>

namespace webots_cloud {
namespace {

namespace fs = std::filesystem;
using core::concat;

result<> check_network(NetworkConfig const& network)
{
    return network.ssl_certificate.empty() ? result<>()
                                           : check_certificate(network.ssl_certificate, network.ssl_key);
}

/// The files that every simulation in a container needs.
result<> check_templates(SimulationConfig const& config, fs::path const& origin)
{
    if (!config.docker)
        return {};
    std::vector<std::string> needed{core::compose_template_file(core::ComposeTemplate::standard)};
    if (!config.containers.project_dockerfiles)
        needed.emplace_back(core::dockerfile_template);
    std::error_code ignored;
    for (auto const& name : needed)
        if (!fs::exists(config.containers.directory / name, ignored))
            return Failure(
                errc::invalid_config,
                concat(origin.string(), ": key \"docker\": no simulation can start, since there is no ", name,
                       " in ", fs::absolute(config.containers.directory, ignored).string(),
                       ". Set \"dockerDir\" to the folder of the templates, as config/simulation/docker"));
    return {};
}

/// Containers have their own Webots.
result<> check_webots(SimulationConfig const& config, fs::path const& origin)
{
    if (config.docker)
        return {};
    auto const checked =
        core::check_webots_home(app::absolute_path(config.webots_home),
                                app::absolute_path(app::environment("WEBOTS_HOME")), app::is_program);
    return checked ? checked : result<>(checked.error().within(origin.string()));
}

result<> check_access(AccessConfig const& access)
{
    if (access.operator_token_file.empty())
        return {};
    auto const token = make_operator_token_check(access.operator_token_file);
    return token ? result<>() : token.error();
}

void warn_of_missing_folders(Configured<SimulationConfig>& configured, fs::path const& origin)
{
    std::error_code ignored;
    for (auto const& forge : configured.config.forges)
        if (!forge.directory.empty() && !fs::is_directory(forge.directory, ignored))
            configured.warnings.push_back(concat(origin.string(), ": key \"forges\": there is no folder ",
                                                 fs::absolute(forge.directory, ignored).string(),
                                                 ": no world of ", forge.url, " can be fetched"));
}

} // namespace

result<> check_files(Configured<SessionConfig>& configured, fs::path const&)
{
    auto const certified = check_network(configured.config.network);
    return certified ? check_access(configured.config.access) : certified;
}

result<> check_files(Configured<SimulationConfig>& configured, fs::path const& origin)
{
    warn_of_missing_folders(configured, origin);
    for (auto const& checked :
         {check_network(configured.config.network), check_access(configured.config.access),
          check_webots(configured.config, origin)})
        if (!checked)
            return checked;
    return check_templates(configured.config, origin);
}

} // namespace webots_cloud
