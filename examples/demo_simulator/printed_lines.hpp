#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::demo {

/// Cuts what a program prints into lines of bounded length.
class PrintedLines
{
public:
    static constexpr std::size_t max_line = 1000; ///< bytes; what is longer becomes several lines

    void add(std::string_view bytes) { text_ += bytes; }

    /// The next complete line, printable and without its end.
    std::optional<std::string> next();

    /// Called when nothing will be added: also what lacks the end of a line.
    std::optional<std::string> last();

private:
    std::string take(std::size_t size, std::size_t end);

    std::string text_;
};

} // namespace webots_cloud::demo
