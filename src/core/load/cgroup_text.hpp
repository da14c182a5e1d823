// Parses the kernel's files about control groups.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace webots_cloud::core {

/// The path of our control group in `/proc/self/cgroup`, such as `/system.slice/x.service`: that of a
/// controller of version 1, or without one that of version 2. Empty when there is none.
std::string_view own_cgroup(std::string_view text, std::string_view controller = {}) noexcept;

/// `cpu.max`, a quota and a period: how many processors' time the group may use; nothing when that is not
/// limited.
std::optional<double> processor_limit(std::string_view text) noexcept;

/// `memory.max`, and other files of one number: bytes; nothing for `max`, for `-1` and for what is no number.
std::optional<std::uint64_t> cgroup_number(std::string_view text) noexcept;

/// The number behind `key` in a file of `key value` lines; 0 without.
std::uint64_t cgroup_value(std::string_view text, std::string_view key) noexcept;

} // namespace webots_cloud::core
