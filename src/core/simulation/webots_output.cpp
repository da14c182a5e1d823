#include "webots_output.hpp"

#include "private_display.hpp"

#include <algorithm>

namespace webots_cloud::core {

OutputLine classify_output(std::string_view line) noexcept
{
    if (line.starts_with('.'))
        return OutputLine::heartbeat;
    if (line == "open")
        return OutputLine::open;
    if (line == "pause")
        return OutputLine::paused;
    if (line == "real-time" || line == "fast" || line == "step")
        return OutputLine::running;
    if (line == "reset")
        return OutputLine::reset;
    if (says_display_has_ended(line))
        return OutputLine::display_ended;
    return OutputLine::other;
}

void LineSplitter::keep(std::string_view bytes)
{
    rest_.append(bytes.substr(0, max_line_length - std::min(max_line_length, rest_.size())));
}

void LineSplitter::feed(std::string_view bytes, Sink const& sink)
{
    for (auto end = bytes.find('\n'); end != std::string_view::npos; end = bytes.find('\n')) {
        keep(bytes.substr(0, end));
        bytes.remove_prefix(end + 1);
        if (rest_.ends_with('\r'))
            rest_.pop_back();
        sink(rest_);
        rest_.clear();
    }
    keep(bytes);
}

void LineSplitter::finish(Sink const& sink)
{
    if (!rest_.empty())
        sink(rest_);
    rest_.clear();
}

} // namespace webots_cloud::core
