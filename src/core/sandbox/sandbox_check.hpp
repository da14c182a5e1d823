// Which sandbox simulations get, from what the operator wants and what works on this machine.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// What a program in the sandbox tries: each must fail.
struct ForbiddenThings
{
    ForbiddenThings() = default;

    std::filesystem::path file; ///< Ours, and outside: to be read.
    std::uint16_t port = 0;     ///< Of this machine's loopback, where somebody listens: to be connected to.
    int process = 0;            ///< Ours: to be signalled.
};

/// The command line of that program, which is the guard's (`--try`).
std::vector<std::string> try_forbidden_things(std::filesystem::path const& guard,
                                              ForbiddenThings const& things);

/// Reads what it printed.
/// Errors: `refused`: something was possible, and the detail says what, as in "a simulation could read files
/// of the server"; `protocol_error`.
result<> judge_sandbox(std::string_view printed);

} // namespace webots_cloud::core
