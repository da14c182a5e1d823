#include "playback.hpp"

#include <algorithm>

namespace webots_cloud::demo {

void Playback::set_deadline(std::int64_t now, std::int64_t duration)
{
    constexpr std::int64_t longest = std::int64_t{1} << 53; // keeps the sum far from overflow
    if (duration < 0)
        deadline_.reset();
    else
        deadline_ = now + std::min(duration, longest);
}

std::string Playback::state_text(std::int64_t now) const
{
    return mode_ == Mode::pause ? "pause: " + std::to_string(now) : state_name();
}

char const* Playback::state_name() const
{
    switch (mode_) {
    case Mode::pause:
        return "pause";
    case Mode::real_time:
        return "real-time";
    case Mode::fast:
        break;
    }
    return "fast";
}

} // namespace webots_cloud::demo
