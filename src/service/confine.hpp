// Puts a program into the sandbox of simulators.
#pragma once

#include <webots_cloud/sandbox.hpp>

namespace webots_cloud {

/// Changes how `process` is started, so that it runs in the sandbox. It may write in `instance` alone; with a
/// network of its own it is reached on `port`.
/// Precondition: there is a sandbox.
void confine(ProcessSpec& process, SandboxParams const& sandbox, std::filesystem::path const& instance,
             std::uint16_t port);

} // namespace webots_cloud
