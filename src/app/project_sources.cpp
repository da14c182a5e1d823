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
    if (!config.projects_dir.empty())
        return config.projects_dir;
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
    std::vector<Forge> forges;
    for (auto const& forge : config.forges) {
        ProjectSource* source = nullptr;
        switch (forge.source()) {
        // All git servers share one source, and with it one cache and its limit.
        case ForgeConfig::Source::git_server:
            source = &git(executor, config, machine, log);
            break;
        case ForgeConfig::Source::folder:
            source = owned_.emplace_back(make_directory_source(forge.directory)).get();
            break;
        }
        forges.emplace_back(ForgeAddress(forge.url, forge.kind), for_users(*source));
    }
    ProjectSource* websites = nullptr;
    if (!config.docker) { // the pages of websites know nothing of containers
        WebsiteSourceParams params;
        params.keys = config.key_dir;
        params.authorities = config.ca_file;
        params.projects = website_templates(config, machine.simulator.program);
        owned_.push_back(make_website_source(std::move(params), log, budget_));
        websites = &for_users(*owned_.back());
    }
    ProjectFetcherParams fetching;
    fetching.instances = instances_;
    fetcher_ = std::make_unique<ProjectFetcher>(fetching, std::move(forges), log, websites);
}

/// What a source needs where simulations run as users of `/etc/subuid`.
ProjectSource& ProjectSources::for_users(ProjectSource& source)
{
    if (!users_)
        return source;
    owned_.push_back(adapters::for_subordinate_users(source, users_, instances_));
    return *owned_.back();
}

ProjectSource& ProjectSources::git(asio::any_io_executor const& executor, SimulationConfig const& config,
                                   SimulationMachine const& machine, Logger const& log)
{
    if (!git_) {
        GitSourceParams params;
        params.cache = machine.cache;
        params.cache_bytes = config.cache_bytes;
        params.instances = instances_;
        params.authorities = config.ca_file;
        git_ = make_git_source(executor, params, log, budget_);
    }
    return *git_;
}

} // namespace webots_cloud::app
