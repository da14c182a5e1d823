// What `srun` prints of a job, between the lines of the simulator.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Reads the output of one job: that of `srun`, of the daemons of Slurm, of the guard on the node, and of the
/// simulator. A simulator can print what looks like a line of Slurm's, and so end itself with a sentence of
/// its choice for its own browser, but not what looks like a line of the guard's: these have a word in them
/// that the simulator does not know, since the guard has printed it before it started the simulator.
class JobOutput
{
public:
    enum class Line
    {
        simulators, ///< The simulator's own.
        ours,       ///< One of Slurm's, with nothing to do.
        waits,      ///< The job waits for a node.
        runs,       ///< The guard runs on `node()`, and starts the simulator.
        listens,    ///< The simulator listens on `port()`.
        ends        ///< Slurm ends the job, or does not start it: `reason()`, a sentence for the browser.
    };

    Line read(std::string_view line);

    std::string const& node() const noexcept { return node_; }
    std::uint16_t port() const noexcept { return port_; }
    std::string const& reason() const noexcept { return reason_; }

private:
    Line read_guard(std::string_view line);
    Line end(std::string_view reason);

    std::string word_; ///< Of the guard; empty: it has not printed anything yet.
    std::string node_;
    std::uint16_t port_ = 0;
    std::string reason_;
};

} // namespace webots_cloud::core
