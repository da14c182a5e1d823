// What server.sh asks of us.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::site {

enum class Verb : std::uint8_t
{
    help,
    start,
    restart,
    stop,
    status,
    ready, ///< Whether a start could begin, before anything is built for it.
    idle   ///< Whether no server runs here: those that are installed would need its ports.
};

struct CommandLine
{
    CommandLine() = default;

    bool operator==(CommandLine const&) const = default;

    Verb verb = Verb::help;
    std::string name;       ///< Of the configurations; empty: not given.
    std::uint16_t port = 0; ///< Of the site, instead of its configuration's; 0: not given.
    std::string complaint;  ///< Not empty: what is wrong, in a sentence.
};

/// Without the program's name.
CommandLine parse_command_line(std::vector<std::string_view> const& arguments);

/// What `--help` prints.
std::string_view help_text() noexcept;

} // namespace webots_cloud::site
