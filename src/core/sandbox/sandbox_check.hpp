// Which sandbox simulations get, from what the operator wants and what works on this machine.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The command line of a program, the guard (`--try`), that tries what must fail in a sandbox: to read
/// `file`, to connect to `port` of the loopback, and to signal `process`.
std::vector<std::string> try_forbidden_things(std::filesystem::path const& guard,
                                              std::filesystem::path const& file, std::uint16_t port,
                                              int process);

/// Reads what it printed.
/// Errors: `refused`: something was possible, and the detail says what, as in "a simulation could read files
/// of the server"; `protocol_error`.
result<> judge_sandbox(std::string_view printed);

} // namespace webots_cloud::core
