// What Webots says on its standard output (protocol section 6.4): bytes in, events out.
#pragma once

#include <functional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// What one line means.
enum class OutputLine
{
    heartbeat,     ///< `.`: the first one says that the world is loaded.
    open,          ///< `open`: the world is loaded (Webots up to R2021b).
    paused,        ///< `pause`
    running,       ///< `real-time`, `fast` or `step`
    reset,         ///< `reset`
    display_ended, ///< The guard says that the simulator has lost its private display.
    other          ///< Anything else: for the log.
};

OutputLine classify_output(std::string_view line) noexcept;

/// Cuts a stream of bytes into lines of bounded length.
class LineSplitter
{
public:
    /// What is longer is cut; the rest of the line is dropped.
    static constexpr std::size_t max_line_length = 16 * 1024;

    using Sink = std::function<void(std::string_view line)>;

    /// Passes each complete line to `sink`, without its `\n` or `\r\n`.
    void feed(std::string_view bytes, Sink const& sink);

    /// Passes what is left when the stream has ended without a final newline.
    void finish(Sink const& sink);

private:
    void keep(std::string_view bytes);

    std::string rest_;
};

} // namespace webots_cloud::core
