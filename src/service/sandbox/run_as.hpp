// Puts a program under another user.
#pragma once

#include <webots_cloud/sandbox.hpp>

#include <cstdint>

namespace webots_cloud {

/// Changes how `process` is started, so that another user runs it, and owns `instance` with everything in it.
/// Does nothing where simulators run as the server's user.
///
/// Call it when nothing else changes the process any more: it replaces what of the environment belongs to the
/// server's user.
/// `number`: the user's, where each simulation has one of its own.
void run_as(ProcessSpec& process, SandboxParams const& sandbox, std::uint32_t number,
            std::filesystem::path const& instance);

/// Changes how `process` is started, so that it runs as a user who owns `instance` already, since another
/// program of that user runs there. To be called last, as `run_as`.
void run_beside(ProcessSpec& process, SandboxParams const& sandbox, ProcessUser owner,
                std::filesystem::path const& instance);

} // namespace webots_cloud
