// Where a simulation server gets projects from: its forges, and the pages of websites.
#pragma once

#include "adapters/process/subordinate_users.hpp"
#include "simulation_machine.hpp"

#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/config.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/transport/logger.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <filesystem>
#include <memory>
#include <vector>

namespace webots_cloud::app {

/// Where the templates of websites' projects are.
std::filesystem::path website_templates(SimulationConfig const& config,
                                        std::filesystem::path const& simulator);

class ProjectSources
{
public:
    /// Lifetime: nothing of `machine` is kept but its subordinate users, which are shared.
    ProjectSources(boost::asio::any_io_executor const& executor, SimulationConfig const& config,
                   SimulationMachine const& machine, Logger const& log);

    ProjectFetcher& fetcher() noexcept { return *fetcher_; }

    /// The users that simulations run as, if they have numbers of a user namespace; null: they don't.
    std::shared_ptr<adapters::SubordinateUsers> const& users() const noexcept { return users_; }

    /// For what visitors write into projects.
    TextFiles& program_files() noexcept { return users_files_ ? *users_files_ : *files_; }

private:
    /// Keeps a source. Returned is the one to use, which puts another before it where simulations run as
    /// users of `/etc/subuid`.
    ProjectSource& own(std::unique_ptr<ProjectSource> source);

    std::shared_ptr<adapters::SubordinateUsers> users_;
    std::filesystem::path instances_;
    std::shared_ptr<FetchBudget> budget_;
    std::vector<std::unique_ptr<ProjectSource>> owned_;
    std::unique_ptr<TextFiles> files_;
    std::unique_ptr<TextFiles> users_files_; ///< By way of `users_`, if there are any.
    std::unique_ptr<ProjectFetcher> fetcher_;
};

} // namespace webots_cloud::app
