#include "command_line.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace webots_cloud::site {
namespace {

using core::concat;

constexpr std::array<std::pair<std::string_view, Verb>, 8> verbs{{{"--help", Verb::help},
                                                                  {"-h", Verb::help},
                                                                  {"start", Verb::start},
                                                                  {"restart", Verb::restart},
                                                                  {"stop", Verb::stop},
                                                                  {"status", Verb::status},
                                                                  {"ready", Verb::ready},
                                                                  {"idle", Verb::idle}}};

bool starts_servers(Verb verb) noexcept
{
    return verb == Verb::start || verb == Verb::restart || verb == Verb::ready;
}

/// A name is part of a path.
bool is_name(std::string_view text) noexcept
{
    constexpr std::string_view letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-";
    return !text.empty() && text.front() != '-' && text.find_first_not_of(letters) == std::string_view::npos;
}

CommandLine refused(std::string sentence)
{
    CommandLine line;
    line.complaint = std::move(sentence);
    return line;
}

} // namespace

CommandLine parse_command_line(std::vector<std::string_view> const& arguments)
{
    if (arguments.empty())
        return refused("Expected a verb, found nothing: --help shows them.");
    auto const* const known =
        std::ranges::find(verbs, arguments[0], &std::pair<std::string_view, Verb>::first);
    if (known == verbs.end())
        return refused(concat("Expected a verb, found \"", arguments[0], "\": --help shows them."));
    CommandLine line;
    line.verb = known->second;
    for (std::size_t i = 1; i < arguments.size(); ++i) {
        auto const each = arguments[i];
        if (each == "--port" && starts_servers(line.verb) && line.port == 0 && i + 1 < arguments.size()) {
            line.port = core::parse_port(arguments[++i]);
            if (line.port == 0)
                return refused(
                    concat("Expected a port after --port, from 1 to 65535, found \"", arguments[i], "\"."));
        } else if (line.name.empty() && (each == "--lan" || is_name(each))) {
            line.name = each == "--lan" ? "lan" : each;
        } else if (line.name.empty() && !each.starts_with('-')) {
            return refused(concat("Expected the name of a configuration, found \"", each, "\"."));
        } else {
            return refused(concat("\"", each, "\" was not expected: --help shows what is."));
        }
    }
    return line;
}

std::string_view help_text() noexcept
{
    return "Usage: webots-site start|restart|ready [NAME|--lan] [--port NUMBER]\n"
           "       webots-site stop|status [NAME|--lan]\n"
           "       webots-site idle\n"
           "\n"
           "Starts and stops the servers of the folder where it is run: what ./server.sh\n"
           "does after building. ./server.sh help says what start, restart, stop and status\n"
           "do; server.sh alone needs the others:\n"
           "\n"
           "  ready   say what would keep a start from beginning, before anything is built\n"
           "  idle    say which server runs here, if any\n"
           "\n"
           "Exit statuses: 0: done, or running; 1: it failed; 2: wrong arguments;\n"
           "3, of status: no such server runs.\n";
}

} // namespace webots_cloud::site
