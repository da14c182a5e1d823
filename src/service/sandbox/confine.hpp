// Puts a program into the sandbox of simulators, and on a display of its own.
#pragma once

#include <webots_cloud/private_display.hpp>
#include <webots_cloud/sandbox.hpp>

namespace webots_cloud {

/// Changes how `process` is started, so that it runs in the sandbox. It may write in `instance` alone; with a
/// network of its own it is reached on `port`.
/// Precondition: there is a sandbox.
void confine(ProcessSpec& process, SandboxParams const& sandbox, std::filesystem::path const& instance,
             std::uint16_t port);

/// Changes how `process` is started, so that it has a display of its own. To be done before `confine`.
/// Precondition: there are private displays.
void give_display(ProcessSpec& process, PrivateDisplay const& display);

} // namespace webots_cloud
