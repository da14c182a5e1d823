#include "compose_output.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

/// `webots` for `<project>-webots-1`, `<project>_webots_1`, `webots-1` and `webots_1`; empty for what is no
/// container.
std::string_view service_of(std::string_view container, std::string_view project)
{
    if (container.starts_with(project) && container.size() > project.size() &&
        (container[project.size()] == '-' || container[project.size()] == '_'))
        container.remove_prefix(project.size() + 1);
    auto const end = container.find_last_of("-_");
    auto const number = end == std::string_view::npos ? std::string_view() : container.substr(end + 1);
    bool const is_number =
        !number.empty() && number.find_first_not_of("0123456789") == std::string_view::npos;
    bool const is_name = container.find_first_of(" :/") == std::string_view::npos;
    return is_number && is_name ? container.substr(0, end) : std::string_view();
}

/// Compose 2 sends `ESC [ 2 K` in front of a container's line, to erase what a terminal shows there; builders
/// colour their lines.
std::string_view without_control_sequences(std::string_view line)
{
    constexpr std::string_view introducer = "\x1b[";
    constexpr std::string_view parameters = "0123456789;";
    while (line.starts_with(introducer)) {
        auto const last = line.find_first_not_of(parameters, introducer.size());
        line = last == std::string_view::npos ? std::string_view() : line.substr(last + 1);
    }
    return line;
}

/// `RUN` for `Step 3/7 : RUN make`; empty for what begins no step.
std::string_view instruction_of(std::string_view line)
{
    constexpr std::string_view mark = " : ";
    auto const found = line.find(mark);
    if (!line.starts_with("Step ") || found == std::string_view::npos)
        return {};
    auto const instruction = trim(line.substr(found + mark.size()));
    return instruction.substr(0, instruction.find(' '));
}

/// By the kernel, which lacked memory, or by us.
bool says_step_was_killed(std::string_view line)
{
    return line.ends_with("returned a non-zero code: 137"); // 128 + SIGKILL
}

/// What compose 1 says last, after the line that says why.
bool says_only_that_it_failed(std::string_view line)
{
    return line.ends_with("failed to build : Build failed") ||
           line.ends_with("Encountered errors while bringing up the project.");
}

} // namespace

ComposeLine parse_compose_line(std::string_view line, std::string_view project)
{
    using enum ComposeLine::Source;
    line = without_control_sequences(line);
    if (auto const bar = line.find('|'); bar != std::string_view::npos) {
        auto const service = service_of(trim(line.substr(0, bar)), project);
        auto text = line.substr(bar + 1);
        if (text.starts_with(' '))
            text.remove_prefix(1);
        if (!service.empty())
            return {service == "webots" ? webots : other, text};
    }
    constexpr std::string_view ending = " exited with code ";
    if (auto const found = line.find(ending); found != std::string_view::npos)
        if (service_of(trim(line.substr(0, found)), project) == "webots")
            return {webots_end, line};
    return {compose, line};
}

bool is_progress(std::string_view line)
{
    return !trim(line).empty() && line.find("theia") == std::string_view::npos;
}

std::string without_project(std::string_view text, std::string_view project)
{
    std::string told;
    for (auto found = text.find(project); !project.empty() && found != std::string_view::npos;
         found = text.find(project)) {
        told.append(text.substr(0, found)).append("simulation");
        text.remove_prefix(found + project.size());
    }
    return told.append(text);
}

void StartWords::of_compose(std::string_view line)
{
    line = trim(line);
    if (auto const instruction = instruction_of(line); !instruction.empty()) {
        words_ = LastWords();
        fetches_ = instruction == "FROM";
    } else if (says_step_was_killed(line)) {
        words_.add(concat("A step of the build failed, since it was killed: each may use as much memory as a "
                          "simulation. ",
                          line));
    } else if (!says_only_that_it_failed(line)) {
        words_.add(line);
    }
}

std::string StartWords::text() const
{
    auto const& text = words_.text();
    return fetches_ && !text.empty() ? concat("The image can't be fetched: ", text) : text;
}

bool says_image_is_missing(std::string_view line, std::string_view image)
{
    auto const says = [&](std::string_view text) { return line.find(text) != std::string_view::npos; };
    return (says("not found") && says(image)) || says("manifest unknown");
}

} // namespace webots_cloud::core
