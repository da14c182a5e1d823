// What a simulator in a sandbox sees of the file system, whichever program makes the sandbox.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// Where the private folder for temporary files is.
inline constexpr char const* sandbox_temporary = "/tmp";
/// Where X servers have their sockets.
inline constexpr char const* display_folder = "/tmp/.X11-unix";

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
    bool own_displays = false; ///< It starts X servers itself; those of the machine are hidden from it.
    std::filesystem::path x_authority; ///< The file of the display's password; empty: none.
    std::filesystem::path resolver;    ///< A file in place of `/etc/resolv.conf`; empty: none is seen.
    /// Folders of the system that are links, and where they lead, as `/bin` does to `usr/bin`.
    std::vector<std::pair<std::filesystem::path, std::filesystem::path>> system_links;
    std::vector<std::filesystem::path> copied; ///< Of `system_files`, small ones that it may have copies of.
    int first_copied = 0; ///< The descriptor of the first of these in the program; the others follow.
    std::uint64_t temporary_bytes = std::uint64_t{512} << 20; ///< What the folder for temporary files holds.
};

/// Folders of the system's programs and libraries, of which not all are everywhere.
std::span<char const* const> system_folders() noexcept;

/// Files and folders, most of them of `/etc`, that libraries, languages and drivers look up, and that every
/// user of the machine may read.
std::span<char const* const> system_files() noexcept;

/// The socket of a display of this machine; empty: it is none.
std::filesystem::path display_socket(std::string_view display);

} // namespace webots_cloud::core
