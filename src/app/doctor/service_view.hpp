// What root is told of a service: the machine as the service sees it.
#pragma once

#include "app/daemon.hpp"
#include "core/doctor/finding.hpp"

#include <filesystem>
#include <string>
#include <string_view>

namespace webots_cloud::app {

struct ServiceView
{
    ServiceView() = default;

    bool is_complete = false; ///< The doctor has looked as the service does.
    core::Findings
        findings; ///< What it has found, or why it could not look; empty: there is no such service.
};

/// Starts the doctor with the user, the folders and the confinement of the service of systemd that has this
/// configuration, where root asks for it. `socket` is the operator's, of the server that runs: a server in a
/// user namespace recognizes root there, but not the doctor that root starts.
/// Blocks for as long as the doctor takes.
ServiceView view_of_service(std::string_view kind, Arguments const& arguments,
                            std::filesystem::path const& socket);

/// Whether this program was started by `view_of_service`.
bool is_asked_by_root();

/// What the server that runs calls itself, as it has told root; empty: root was not told, or has not asked.
std::string instance_told_by_root();

} // namespace webots_cloud::app
