// Graphics processors whose drivers tell the kernel who uses them (amdgpu, i915, nouveau and others).
#pragma once

#include <webots_cloud/time.hpp>

#include <filesystem>
#include <span>

namespace webots_cloud::adapters {

/// How many there are.   `devices`: `/dev/dri`.
int count_drm_devices(std::filesystem::path const& devices);

/// How long these processes have kept graphics processors busy, with all that they have open now; what they
/// share counts once. Looks at 2,048 of their open files at most, and only at those that we may look at.
/// `proc`: `/proc`.
Duration drm_time(std::filesystem::path const& proc, std::span<int const> processes);

} // namespace webots_cloud::adapters
