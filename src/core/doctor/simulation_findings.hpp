// What the readings of a simulation server's own parts mean: the simulator, its screen, its walls.
#pragma once

#include "finding.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Which simulator runs here.
struct SimulatorReading
{
    SimulatorReading() = default;

    std::filesystem::path program;
    bool is_webots = true;    ///< False: it is the demo simulator.
    std::string version_text; ///< The file beside Webots; empty: there is none.
};

/// Errors of `reading`: there is no simulator.
Finding judge_simulator(result<SimulatorReading> const& reading);

/// What an attempt at the sandbox, the user or the display has come to.
struct AttemptReading
{
    AttemptReading() = default;

    std::string description;           ///< As on the monitor page: "bubblewrap, public internet only".
    std::vector<std::string> warnings; ///< That the server would write into its log.
};

/// `key`: of the configuration, for the remedy.
Finding judge_attempt(std::string_view subject, std::string_view key, result<AttemptReading> const& reading);

/// `unkept`: a sentence, as `unkept_limits` says.
Finding judge_limits(std::string_view unkept);

/// What a start of the simulator with an empty world has come to.
struct StartReading
{
    StartReading() = default;

    result<> outcome; ///< Errors: why the world is not loaded.
    Duration took{};
    std::vector<std::string> printed; ///< The last lines, printable.
};

Finding judge_start(StartReading const& reading);

struct GraphicsReading
{
    GraphicsReading() = default;

    std::vector<std::string> devices; ///< As /dev/dri/renderD128, that may be used by us.
    std::vector<std::string> closed;  ///< The same, that we may not use.
    std::string models;               ///< As NVIDIA's library says; empty: there is none.
};

Finding judge_graphics(GraphicsReading const& reading);

/// What `glxinfo -B` has printed; Errors: it can't draw there.
Finding judge_renderer(result<std::string> const& printed);

/// What `docker info` has said; Errors: there is no docker, or it said nothing.
Finding judge_docker(result<std::string> const& info);

/// What `sinfo` has said, a line for each partition. `state`: the folder that nodes have to see, which nobody
/// can try from here.
Finding judge_slurm(result<std::string> const& partitions, std::string_view state);

} // namespace webots_cloud::core
