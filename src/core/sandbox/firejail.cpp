#include "firejail.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>

namespace webots_cloud::core {
namespace {

constexpr std::size_t max_name_servers = 3;

// What a simulator sees as it is, read-only, or what firejail covers in ways of its own.
constexpr std::array<std::string_view, 9> system_folders{"/usr",   "/bin",    "/sbin", "/lib", "/lib32",
                                                         "/lib64", "/libx32", "/proc", "/dev"};

// Without the first two lines the sandbox lives on after the simulator, as long as any other program in it
// does. Devices that simulators have no business with, and firejail would show with those of graphics
// processors.
constexpr std::string_view settings = "deterministic-shutdown\n"
                                      "deterministic-exit-code\n"
                                      "caps.drop all\n"
                                      "nonewprivs\n"
                                      "seccomp\n"
                                      "restrict-namespaces\n"
                                      "private-dev\n"
                                      "nosound\n"
                                      "nodvd\n"
                                      "notv\n"
                                      "nou2f\n"
                                      "novideo\n"
                                      "noinput\n"
                                      "blacklist /dev/log\n"
                                      "hostname simulation\n"
                                      "read-only /\n"
                                      "read-write /tmp\n";

bool is_of_system(std::filesystem::path const& path)
{
    auto const& name = path.native();
    return std::any_of(system_folders.begin(), system_folders.end(), [&](auto const folder) {
        return name.starts_with(folder) && (name.size() == folder.size() || name[folder.size()] == '/');
    });
}

/// Appends words to a command line that show a path.
void show(std::vector<std::string>& command, std::filesystem::path const& path)
{
    if (path.empty() || is_of_system(path)) // the first thing shown in a folder hides all others
        return;
    command.push_back(concat("--whitelist=", path.native()));
    command.push_back(concat("--read-only=", path.native()));
}

} // namespace

std::vector<std::string> name_servers(std::string_view resolver)
{
    constexpr std::string_view key = "nameserver";
    std::vector<std::string> found;
    for (auto const line : split(resolver, '\n')) {
        if (!line.starts_with(key) || found.size() == max_name_servers)
            continue;
        auto const rest = line.substr(key.size());
        auto const address = trim(rest);
        if (!address.empty() && address.size() < rest.size() && address.find(' ') == std::string_view::npos)
            found.emplace_back(address);
    }
    return found;
}

std::string firejail_profile(FirejailMachine const& machine)
{
    std::string profile(settings);
    if (!machine.has_graphics)
        profile.append("blacklist /sys\n");
    for (auto const& folder : machine.folders)
        if (!is_of_system(folder) && folder != "/etc" && folder != "/sys")
            profile.append(concat("whitelist ", (folder / ".nothing").native(), "\n"));
    for (auto const& file : machine.files)
        if (!is_of_system(file))
            profile.append(concat("blacklist ", file.native(), "\n"));
    for (auto const* file : system_files())
        profile.append(concat("whitelist ", file, "\n"));
    for (auto const& server : machine.name_servers)
        profile.append(concat("dns ", server, "\n"));
    return profile;
}

std::vector<std::string> firejail_command(std::filesystem::path const& firejail,
                                          std::filesystem::path const& profile, Visible const& visible,
                                          std::vector<std::string> const& argv)
{
    std::vector<std::string> command{firejail.native(), "--quiet", concat("--profile=", profile.native())};
    // firejail sets it to the home of the user, which is hidden and can't be written.
    command.push_back(concat("--env=HOME=", sandbox_temporary));
    for (auto const& path : visible.read_only)
        show(command, path);
    show(command, display_socket(visible.display));
    if (visible.own_displays) {
        command.push_back(concat("--whitelist=", display_folder));
        command.push_back(concat("--read-write=", display_folder));
    }
    show(command, visible.x_authority);
    command.push_back(concat("--whitelist=", visible.instance.native()));
    command.push_back(concat("--read-write=", visible.instance.native()));
    command.emplace_back("--");
    command.insert(command.end(), argv.begin(), argv.end());
    return command;
}

} // namespace webots_cloud::core
