// What a simulation server reports when it is asked for its load.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What a world is known by: digests, since reports are for everybody to read. Equal addresses and modes
/// have equal keys everywhere.
struct WorldKey
{
    WorldKey() = default;

    std::uint64_t world = 0;      ///< Of its address and mode.
    std::uint64_t repository = 0; ///< Of the address up to the repository, and the mode.
    std::uint64_t mode = 0;

    bool operator==(WorldKey const&) const = default;
};

/// `address`: as in `start`. Not secret: anybody with an address can tell whether a key is its.
WorldKey world_key(std::string_view address, std::string_view mode) noexcept;

/// What a project is known by where somebody has it in a cache: of the address of one of its worlds, up to
/// the folder `worlds`. `blob` or `tree`, percent-encoding, a query and a fragment make no difference.
std::uint32_t project_key(std::string_view world_address);
/// The same of its parts, decoded: `https://github.com/o/r` and `<ref>[/<folder>]`.
std::uint32_t project_key(std::string_view repository, std::string_view ref_and_folder) noexcept;

/// What the simulations of one world on one machine use together.
struct WorldUse
{
    WorldUse() = default;

    WorldKey key;
    int running = 0;       ///< Simulations that are ready,
    int starting = 0;      ///< and others.
    double processors = 0; ///< That those running keep busy.
    double memory = 0;     ///< Bytes, of those running.
    double graphics = 0;   ///< Graphics processors that they keep busy.

    bool operator==(WorldUse const&) const = default;
};

/// One answer to `GET /load`. The Python servers report only the load; ours report the rest as well.
struct LoadReport
{
    LoadReport() = default;
    explicit LoadReport(double load) : load(load) {}

    /// Percent; 0 is idle, 100 is full. Finite and not negative.
    double load = 0;
    /// Simulations that run or are being started.
    std::optional<int> sessions;
    /// Those of `sessions` that are not ready yet, whose load `load` does not show. Absent: all of `sessions`
    /// count as ready, so leave those that start out of `sessions` then.
    std::optional<int> starting;
    /// The most simulations that the server will run at once.
    std::optional<int> capacity;
    /// Percent of the memory in use: a hard limit for placement, unlike the processor.
    std::optional<double> memory;
    /// The server takes no new simulations.
    bool draining = false;
    /// Browsers that asked for a simulation, whatever became of that. This and the other counters begin with
    /// 0 when the server starts, and never decrease while it runs.
    std::optional<std::int64_t> arrivals;
    /// Only with `arrivals`: those of them whose simulation failed or was cancelled before it was ready.
    std::optional<std::int64_t> failed;
    /// Those of `arrivals` that are not among `sessions` any more, `failed` included.
    std::optional<std::int64_t> departures;
    /// What the server can run, in words of its operator's, as in `gpu`, and what it knows itself: `docker`,
    /// or the release of its Webots, as in `R2025a`. At most 32, each as in `PlacementRequest::labels`.
    std::vector<std::string> labels;
    /// Processors of the machine: only with `worlds`.
    std::optional<double> processors;
    /// Bytes of memory of the machine: only with `worlds`.
    std::optional<double> memory_bytes;
    /// Graphics processors of the machine: only with `worlds`. Absent: it does not know what they do.
    std::optional<double> graphics_processors;
    /// What its simulations use, by world: at most `max_worlds`, those with the most simulations.
    std::vector<WorldUse> worlds;
    static constexpr std::size_t max_worlds = 64;
    /// The projects that it has in its cache, by their `project_key`, those used last first: at most
    /// `max_projects`.
    std::vector<std::uint32_t> projects;
    static constexpr std::size_t max_projects = 128;
    /// How many simulations it would have ready for the classes of session servers, at most. Absent: none.
    std::optional<int> staging;

    bool operator==(LoadReport const&) const = default;
};

/// Reads the body of a `/load` answer: a bare number, or the JSON object of our own servers.
///
/// Errors: `errc::protocol_error` for anything but a finite number from 0 up, its detail quoting the start of
/// the body.
result<LoadReport> parse_load_report(std::string_view body);

/// The JSON object that `parse_load_report` reads. `version` is this program's own.
std::string to_json(LoadReport const& report, std::string_view version);

} // namespace webots_cloud
