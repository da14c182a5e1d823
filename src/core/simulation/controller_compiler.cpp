#include "controller_compiler.hpp"

#include <string_view>

namespace webots_cloud::core {

std::filesystem::path common_makefile(std::filesystem::path const& home)
{
    return home / "resources/Makefile.include";
}

std::vector<std::string> compile_command(std::filesystem::path const& make, std::filesystem::path const& home,
                                         std::filesystem::path const& folder, bool has_makefile)
{
    // A folder of another user can't be our working directory.
    std::vector<std::string> command{make.native(), "--no-print-directory", "-C", folder.native()};
    if (!has_makefile)
        command.insert(command.end(), {"-f", common_makefile(home).native()});
    return command;
}

std::vector<std::pair<std::string, std::string>> compile_variables(std::filesystem::path const& home)
{
    return {{"WEBOTS_HOME", home.native()}, {"LC_ALL", "C"}};
}

std::string without_home(std::string printed, std::filesystem::path const& home)
{
    constexpr std::string_view name = "$WEBOTS_HOME";
    auto const& place = home.native();
    for (auto at = printed.find(place); at != std::string::npos; at = printed.find(place, at + name.size()))
        printed.replace(at, place.size(), name);
    return printed;
}

} // namespace webots_cloud::core
