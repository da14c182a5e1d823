// Picks the line of a program's output that explains best why it ended, to show it to users.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Keeps the last line that mentions an error, or the last line while none did: after an error there is often
/// advice ("Try --help"), or the last output of another program.
class LastWords
{
public:
    /// Takes a line of the output. Blank lines are ignored, and only the beginning of long ones is kept.
    void add(std::string_view line);

    /// The line; empty: there was none.
    std::string const& text() const noexcept { return text_; }

private:
    std::string text_;
    bool is_error_ = false;
};

/// The same for a whole output.
std::string last_words(std::string_view output);

} // namespace webots_cloud::core
