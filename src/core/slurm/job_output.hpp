// What `srun` prints of a job, between the lines of the simulator.
#pragma once

#include <webots_cloud/error.hpp>

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Reads the output of one job: that of `srun`, of the daemons of Slurm, of the guard on the node, and of the
/// simulator. A simulator can print what looks like a line of Slurm's, and so end itself with a sentence of
/// its choice for its own browser, but not what looks like a line of the guard's: these have a word in them
/// that the simulator does not know, since the guard has printed it before it started the simulator.
/// Where its project is copied to the node, what goes wrong with that is told before the simulator starts.
class JobOutput
{
public:
    enum class Line
    {
        simulators, ///< The simulator's own.
        ours,       ///< One of Slurm's, with nothing to do.
        waits,      ///< The job waits for a node.
        runs,       ///< The guard runs on `node()`, and starts the simulator.
        receives,   ///< The node has received `usage().received` bytes of the project.
        listens,    ///< The simulator listens on `port()`.
        uses,       ///< The simulator uses `usage()`.
        ends        ///< Slurm ends the job, or does not start it: `reason()`, for the browser.
    };

    /// What the guard on the node has counted last.
    struct Usage
    {
        Usage() = default;

        std::uint64_t received = 0; ///< Bytes of the project, while it is copied.
        std::chrono::milliseconds processor{};
        std::uint64_t memory = 0;     ///< Bytes.
        std::uint64_t own_memory = 0; ///< Of that, what no file is behind.
        std::uint64_t processes = 0;  ///< And threads.
        bool complete = true;
        std::uint64_t disk = 0;      ///< Bytes in the folder of the job, where it has one.
        bool too_many_files = false; ///< In there.
    };

    Line read(std::string_view line);

    std::string const& node() const noexcept { return node_; }
    std::string const& number() const noexcept { return number_; } ///< Slurm's, once it runs.
    std::uint16_t port() const noexcept { return port_; }
    Usage const& usage() const noexcept { return usage_; }
    Failure const& reason() const noexcept { return reason_; }

private:
    Line read_guard(std::string_view line);
    Line end(Failure reason);
    Line end_without_project();
    bool has_no_simulator() const noexcept { return node_.empty() || copies_; }

    std::string word_; ///< Of the guard; empty: it has not printed anything yet.
    std::string node_;
    std::string number_;
    std::uint16_t port_ = 0;
    Usage usage_;
    bool copies_ = false;      ///< The project is being copied.
    std::string copy_trouble_; ///< What is wrong with that.
    Failure reason_;           ///< Without a sentence: there is none yet.
};

/// What a browser is told whose project is being copied.
std::string copying_text(std::uint64_t received);

} // namespace webots_cloud::core
