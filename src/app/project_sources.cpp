#include "project_sources.hpp"

#include "adapters/projects/subordinate_source.hpp"
#include "simulation_folders.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <utility>

namespace webots_cloud::app {

namespace asio = boost::asio;
namespace fs = std::filesystem;

fs::path website_templates(SimulationConfig const& config, fs::path const& simulator)
{
    if (!config.websites.projects.empty())
        return config.websites.projects;
    return simulator.parent_path() / "projects" / "samples" / "robotbenchmark";
}

ProjectSources::ProjectSources(asio::any_io_executor const& executor, SimulationConfig const& config,
                               SimulationMachine const& machine, Logger const& log)
    : instances_(machine.instances()), budget_(make_fetch_budget(config.fetch_memory, config.fetch_disk)),
      files_(make_text_files())
{
    // These users may have been found, and yet be unable to make the sandbox: then simulations run as ours.
    if (machine.trial.sandbox.params.user.user_namespace >= 0)
        users_ = machine.trial.user.subordinate;
    if (users_)
        users_files_ = adapters::for_subordinate_users(*files_, users_, instances_);
    // Servers that are asked in one way share a source, and with it one cache and its limit.
    ProjectSource* git = nullptr;
    auto const source_of_server = [&](ForgeKind kind) -> ProjectSource& {
        switch (kind) { // without "default": the compiler asks about a new kind
        case ForgeKind::unknown:
        case ForgeKind::github:
        case ForgeKind::gitlab:
        case ForgeKind::gitea:
        case ForgeKind::bitbucket:
            break;
        }
        if (!git)
            git = &own(make_git_source(executor, config.git, config.http_client,
                                       GitFolders(machine.cache, instances_), log, budget_));
        return *git;
    };
    std::vector<Forge> forges;
    for (auto const& forge : config.forges) {
        ForgeAddress const address(forge.url, forge.kind);
        forges.emplace_back(address, forge.is_server() ? source_of_server(address.kind)
                                                       : own(make_directory_source(forge.directory)));
    }
    ProjectSource* websites = nullptr;
    if (!config.docker) { // the pages of websites know nothing of containers
        auto settings = config.websites;
        settings.projects = website_templates(config, machine.simulator.program);
        websites = &own(make_website_source(std::move(settings), config.http_client, log, budget_));
    }
    ProjectFetcherParams fetching;
    fetching.instances = instances_;
    fetcher_ = std::make_unique<ProjectFetcher>(fetching, std::move(forges), log, websites);
}

ProjectSource& ProjectSources::own(std::unique_ptr<ProjectSource> source)
{
    auto& made = *owned_.emplace_back(std::move(source));
    return users_ ? *owned_.emplace_back(adapters::for_subordinate_users(made, users_, instances_)) : made;
}

} // namespace webots_cloud::app
