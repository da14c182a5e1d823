// Parses the output of compose while it builds and runs the containers of a simulation (protocol
// section 6.4).
#pragma once

#include "core/simulation/last_words.hpp"

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// The origin and the text of a line.
struct ComposeLine
{
    enum class Source
    {
        compose,    ///< Compose itself, or a build.
        webots,     ///< The simulator.
        other,      ///< Another container.
        webots_end, ///< Compose, about the end of the simulator's container.
    };

    ComposeLine() = default;
    ComposeLine(Source source, std::string_view text) : source(source), text(text) {}

    Source source = Source::compose;
    std::string_view text; ///< Without the name of the container that printed it.
    bool operator==(ComposeLine const&) const = default;
};

/// Parses a line. Depending on the version of compose, the names of containers begin with the project's name
/// or not, and contain hyphens or underscores.
ComposeLine parse_compose_line(std::string_view line, std::string_view project);

/// Whether the browser is shown the line while it waits: not the editor's output, and no empty lines.
bool is_progress(std::string_view line);

/// A text for the browser: names of containers, networks and images begin with the project's, which nobody is
/// told who could build an image from them.
std::string without_project(std::string_view text, std::string_view project);

/// Keeps the line that says best why a start has failed. Where a step of a build begins, all before it went
/// well: what was said until then, such as warnings of a package manager, explains nothing any more. So the
/// engine's own words are found even if they are as short as "unauthorized".
class StartWords
{
public:
    /// A line of compose or of a build.
    void of_compose(std::string_view line);
    void of_simulator(std::string_view line) { words_.add(line); }

    /// Empty: nothing was said.
    std::string text() const;

private:
    LastWords words_;
    bool fetches_ = false; ///< The step is FROM.
};

/// Whether compose reports that `image` does not exist. A build may lack other things too.
bool says_image_is_missing(std::string_view line, std::string_view image);

} // namespace webots_cloud::core
