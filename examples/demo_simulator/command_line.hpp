#pragma once

#include "faults.hpp"
#include "playback.hpp"

#include <chrono>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace webots_cloud::demo {

enum class StreamMode
{
    scene, ///< `x3d` and `w3d`: the browser draws
    mjpeg  ///< the simulator draws
};

/// What Webots' command line asks for.
struct Options
{
    std::filesystem::path world;
    unsigned short port = 1234;
    std::chrono::milliseconds heartbeat{1000};
    Mode mode = Mode::real_time;
    StreamMode stream = StreamMode::scene;
    bool echo_console = false;    ///< `--stdout`: robots' lines go to stdout too
    bool extern_urls = false;     ///< `--extern-urls`: prints where extern controllers connect
    bool old_protocol = false;    ///< `--stream="port=..;monitorActivity"`: prints `open` when ready
    bool controller_edit = false; ///< `controllerEdit` in the same: clients may change controllers
    std::string address;          ///< to listen on; empty: every address
    Faults faults;
};

/// Print and exit with status 0.
struct Notice
{
    std::string text;
};

/// Print on stderr and exit with status 1.
struct Refusal
{
    std::string text;
};

/// The environment variables that matter, read once in main.
struct Environment
{
    std::string faults;  ///< WEBOTS_DEMO_FAULTS
    std::string address; ///< WEBOTS_DEMO_ADDRESS
};

using CommandLine = std::variant<Options, Notice, Refusal>;

/// Reads the arguments that follow the program's name.
CommandLine parse_command_line(std::vector<std::string> const& arguments, Environment const& environment);

} // namespace webots_cloud::demo
