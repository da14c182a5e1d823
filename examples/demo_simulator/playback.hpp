#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace webots_cloud::demo {

enum class Mode
{
    pause,
    real_time,
    fast
};

/// Whether the simulation runs, and until when. Times are simulated milliseconds.
class Playback
{
public:
    explicit Playback(Mode mode) : mode_(mode) {}

    Mode mode() const { return mode_; }
    void set_mode(Mode mode) { mode_ = mode; }

    /// The simulation pauses `duration` after `now`; never, when `duration` is negative.
    void set_deadline(std::int64_t now, std::int64_t duration);
    void clear_deadline() { deadline_.reset(); }

    /// True when the simulation runs although its deadline has passed.
    bool must_pause(std::int64_t now) const { return mode_ != Mode::pause && deadline_ && now >= *deadline_; }

    /// The state frame: "pause: <now>", "real-time" or "fast".
    std::string state_text(std::int64_t now) const;

    /// The state's name: "pause", "real-time" or "fast".
    char const* state_name() const;

private:
    Mode mode_;
    std::optional<std::int64_t> deadline_;
};

} // namespace webots_cloud::demo
