#include "service_unit.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>

namespace webots_cloud::core {
namespace {

/// Beginnings of names. `RuntimeDirectory=` is among them: systemd removes that folder when the program ends,
/// and in it is the operator's socket of the server that runs.
constexpr std::array<std::string_view, 14> of_its_life{
    "Exec",    "FinalKill", "Kill",    "Notify",   "OOMPolicy",   "PIDFile", "RemainAfterExit",
    "Restart", "Runtime",   "Sockets", "Standard", "SuccessExit", "Timeout", "Watchdog"};

bool is_of_its_life(std::string_view name)
{
    return name == "Type" ||
           std::ranges::any_of(of_its_life, [name](auto beginning) { return name.starts_with(beginning); });
}

/// Lines without comments; those that end with a backslash go on in the next one.
std::vector<std::string> whole_lines(std::string_view text)
{
    std::vector<std::string> lines;
    bool goes_on = false;
    for (auto line : split(text, '\n')) {
        line = trim(line);
        if (line.starts_with('#') || line.starts_with(';'))
            continue;
        bool const continues = line.ends_with('\\');
        if (continues)
            line.remove_suffix(1);
        if (goes_on)
            lines.back() += concat(" ", trim(line));
        else
            lines.emplace_back(trim(line));
        goes_on = continues;
    }
    return lines;
}

} // namespace

ServiceUnit parse_service_unit(std::string_view text, std::string_view name)
{
    ServiceUnit unit;
    bool is_service = false;
    bool has_user = false;
    bool is_user_made = false;
    for (auto const& line : whole_lines(text)) {
        if (line.starts_with('['))
            is_service = line == "[Service]";
        auto const equals = line.find('=');
        if (!is_service || equals == std::string::npos)
            continue;
        auto const key = trim(std::string_view(line).substr(0, equals));
        auto const value = trim(std::string_view(line).substr(equals + 1));
        if (key == "ExecStart")
            unit.command = value;
        if (key == "ExecStartPre") // an empty one takes back those before
            unit.pins_users =
                !value.empty() && (unit.pins_users || value.find(" --pin-users ") != std::string_view::npos);
        if (is_of_its_life(key))
            continue;
        has_user = has_user || key == "User";
        if (key == "DynamicUser")
            is_user_made = value == "yes" || value == "true" || value == "1" || value == "on";
        unit.settings.push_back(concat(key, "=", value));
    }
    // Services with one name for their users share the user, who owns the folders of the one that runs.
    if (is_user_made && !has_user)
        unit.settings.push_back(concat("User=", name));
    return unit;
}

} // namespace webots_cloud::core
