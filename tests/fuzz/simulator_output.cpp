// What simulators print: the same lines in one piece as byte by byte, none longer than allowed and none lost;
// and the log of it stays within its size.
#include "fuzz.hpp"

#include "core/docker/compose_output.hpp"
#include "core/simulation/simulation_log.hpp"
#include "core/simulation/webots_output.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

std::vector<std::string> cut(std::string_view text, std::size_t piece)
{
    std::vector<std::string> lines;
    core::LineSplitter splitter;
    auto const sink = [&lines](std::string_view line) { lines.emplace_back(line); };
    while (!text.empty())
        splitter.feed(fuzz::take(text, piece), sink);
    splitter.finish(sink);
    return lines;
}

void check_lines(std::vector<std::string> const& lines, std::string_view text)
{
    auto const ends = static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
    fuzz::require(lines.size() == ends || lines.size() == ends + 1);
    for (auto const& line : lines) {
        fuzz::require(line.size() <= core::LineSplitter::max_line_length);
        fuzz::require(line.find('\n') == std::string::npos);
        bool const beats = line.starts_with('.');
        fuzz::require(beats == (core::classify_output(line) == core::OutputLine::heartbeat));
    }
}

/// Nothing that the simulator prints is taken for words of compose's, and its words are a part of the line.
void check_compose(std::vector<std::string> const& lines)
{
    for (auto const& line : lines) {
        auto const container = "p-webots-1  | " + line;
        auto const parsed = core::parse_compose_line(container, "p");
        fuzz::require(parsed.source == core::ComposeLine::Source::webots && parsed.text == line);
        auto const any = core::parse_compose_line(line, "p");
        fuzz::require(line.ends_with(any.text));
    }
}

void check_log(std::vector<std::string> const& lines)
{
    constexpr std::size_t first = 200;
    constexpr std::size_t last = 300;
    constexpr std::size_t note = 100;
    std::size_t longest = 0;
    std::string written;
    core::KeptOutput log(first, last);
    for (auto const& line : lines) {
        longest = std::max(longest, line.size());
        written += log.take(line);
    }
    written += log.finish();
    fuzz::require(written.size() <= first + last + note + 2 * (longest + 1));
    if (!lines.empty() && lines.back().size() < last)
        fuzz::require(written.ends_with(lines.back() + "\n"));
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, std::min<std::size_t>(size, 300)); // more says nothing new
    auto const lines = cut(text, size + 1);
    fuzz::require(lines == cut(text, 1));
    check_lines(lines, text);
    check_compose(lines);
    check_log(lines);
    return 0;
}
