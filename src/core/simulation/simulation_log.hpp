// The log of one simulation: its name, what of the simulator's output it keeps, and which logs are removed.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// `2026-01-31_13-59-59_7.log`; `time` is `2026-01-31 13:59:59`.
std::string simulation_log_name(std::string_view time, std::uint64_t id);

/// True for what `simulation_log_name` makes, and for nothing else.
bool is_simulation_log_name(std::string_view name) noexcept;

/// Keeps the first and the last lines of an output of any length: the beginning goes to the file as it comes,
/// the end waits in memory, so that a simulator that never stops talking fills neither.
class KeptOutput
{
public:
    KeptOutput(std::size_t first_bytes, std::size_t last_bytes)
        : first_left_(first_bytes), last_bytes_(last_bytes)
    {}

    /// Takes a line without its end; returns what to write now, possibly nothing.
    std::string take(std::string line);

    /// The rest, with a note of what was left out in between.
    std::string finish();

private:
    std::size_t first_left_;
    std::size_t last_bytes_;
    std::deque<std::string> last_;
    std::size_t size_of_last_ = 0;
    std::uint64_t left_out_ = 0; ///< Lines.
};

/// A log that exists.
struct SimulationLogFile
{
    SimulationLogFile() = default;
    SimulationLogFile(std::string name, Duration age) : name(std::move(name)), age(age) {}

    std::string name;
    Duration age{}; ///< Since the last line.
};

/// The names of the logs that have to go: those older than `keep`, and of the others all but the youngest
/// `max`.
std::vector<std::string> outdated_logs(std::vector<SimulationLogFile> files, Duration keep, std::size_t max);

} // namespace webots_cloud::core
