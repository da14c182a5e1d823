#pragma once

#include <chrono>
#include <optional>
#include <string_view>
#include <variant>

#include <string>

namespace webots_cloud::demo {

/// Ways to misbehave on demand, so that a simulation server can be tested against them.
struct Faults
{
    bool never_ready = false;
    std::chrono::milliseconds ready_delay{0};
    std::optional<int> exit_before_ready;                       ///< exit status
    std::optional<std::chrono::milliseconds> exit_after_ready;  ///< exits with status 0 after this time
    bool crash_before_ready = false;                            ///< SIGSEGV
    std::optional<std::chrono::milliseconds> crash_after_ready; ///< SIGSEGV after this time
    std::optional<std::chrono::milliseconds> hang;              ///< stops answering this long after ready
    bool ignore_sigterm = false;
    bool grandchild = false;        ///< forks a child that stays in the process group
    bool daemon_grandchild = false; ///< forks a child that leaves the session and ignores SIGTERM
    bool flood = false;
    bool wrong_port = false;
    bool long_lines = false;
    bool binary_lines = false;
    bool no_final_newline = false;
    bool refuse_w3d = false; ///< as releases up to R2023a
    bool refuse_x3d = false; ///< as releases from R2023b
};

/// Reads a comma-separated list such as "ready-delay=500,exit-after-ready". Returns the sentence that says
/// what is wrong with it otherwise. Adds to `already`, so that lists from several places combine.
std::variant<Faults, std::string> parse_faults(std::string_view list, Faults already = {});

/// The part of `--help` that names every fault.
std::string_view fault_help();

} // namespace webots_cloud::demo
