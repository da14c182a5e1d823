// How a simulator is confined by bubblewrap: what it sees of the file system, as a command line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace webots_cloud::core {

/// Where the private folder for temporary files is, and the simulator's home in it.
inline constexpr char const* sandbox_temporary = "/tmp";
inline constexpr char const* sandbox_home = "/tmp/home";

/// What a simulator may see besides the system's programs and libraries. Paths that do not exist are left
/// out.
struct Visible
{
    Visible() = default;

    std::filesystem::path instance;               ///< Its own folder, which it may change.
    std::filesystem::path directory;              ///< Where it starts.
    std::vector<std::filesystem::path> read_only; ///< Webots above all.
    std::vector<std::filesystem::path> devices;   ///< Of graphics processors.
    std::string display;                          ///< As `DISPLAY` has it; only `:<number>` is of use.
    std::filesystem::path x_authority;            ///< The file of the display's password; empty: none.
    std::filesystem::path resolver; ///< A file in place of `/etc/resolv.conf`; empty: none is seen.
    std::uint64_t temporary_bytes = std::uint64_t{512} << 20; ///< What the folder for temporary files holds.
};

/// The command line that runs `argv` so. It sees no other processes, has no capability and can't get any,
/// and dies with whoever started it. Of `/etc` it sees what libraries look up, and nothing that could be a
/// secret.
///
/// The network is not bubblewrap's: see `ProcessNetwork`.
std::vector<std::string> bubblewrap_command(std::filesystem::path const& bubblewrap, Visible const& visible,
                                            std::vector<std::string> const& argv);

} // namespace webots_cloud::core
