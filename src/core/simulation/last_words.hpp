// Why a program ended, as far as it printed that: the one line of its output that users are shown.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Remembers the last line that speaks of an error, or the last of all while none did: what comes after an
/// error is often advice
/// ("Try --help"), or a farewell of another program.
class LastWords
{
public:
    /// A line as it was printed. Blank ones say nothing, and of long ones the beginning is kept.
    void hear(std::string_view line);

    /// The line; empty: there was none.
    std::string const& text() const noexcept { return text_; }

private:
    std::string text_;
    bool is_error_ = false;
};

/// The same for a whole output.
std::string last_words(std::string_view output);

} // namespace webots_cloud::core
