// The files of control groups, version 2: texts of the kernel to values.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace webots_cloud::core {

/// The path of our control group in `/proc/self/cgroup`, such as `/system.slice/x.service`; empty when there
/// is none of version 2.
std::string_view unified_cgroup(std::string_view text) noexcept;

/// `cpu.max`: how many processors' time the group may use; nothing when that is not limited.
std::optional<double> processor_limit(std::string_view text) noexcept;

/// `memory.max`, and other files of one number: bytes; nothing for `max` and for what is no number.
std::optional<std::uint64_t> cgroup_number(std::string_view text) noexcept;

/// The number behind `key` in a file of `key value` lines; 0 without.
std::uint64_t cgroup_value(std::string_view text, std::string_view key) noexcept;

} // namespace webots_cloud::core
