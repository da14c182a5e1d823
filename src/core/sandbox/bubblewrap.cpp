#include "bubblewrap.hpp"

#include <algorithm>
#include <initializer_list>
#include <string_view>

namespace webots_cloud::core {
namespace {

// Where the libraries of graphics processors find out what there is.
constexpr std::initializer_list<char const*> device_descriptions = {"/sys/dev/char", "/sys/class/drm",
                                                                    "/sys/devices"};

// Their files belong to root, whoever mounts `/proc`: a simulation of root's could write them without any
// capability, and so run programs outside (`core_pattern`). bubblewrap covers them only where the folder
// itself can be written.
constexpr std::initializer_list<char const*> kernel_settings = {"/proc/sys", "/proc/irq", "/proc/bus",
                                                                "/proc/fs"};

constexpr std::uint64_t max_display_bytes = std::uint64_t{64} << 10; // sockets and a password
constexpr std::uint64_t shared_memory_bytes = std::uint64_t{256} << 20;

/// Appends words to a command line.
class Words
{
public:
    explicit Words(std::vector<std::string>& words) : words_(words) {}

    void add(std::initializer_list<std::string_view> words)
    {
        words_.insert(words_.end(), words.begin(), words.end());
    }
    void show(std::filesystem::path const& path) { add({"--ro-bind-try", path.native(), path.native()}); }
    void link(std::filesystem::path const& path, std::filesystem::path const& target)
    {
        add({"--symlink", target.native(), path.native()});
    }
    void copy(int descriptor, std::filesystem::path const& path)
    {
        add({"--perms", "0444", "--file", std::to_string(descriptor), path.native()});
    }

    /// An empty folder in memory.
    void make_folder(std::string_view path, std::uint64_t max_bytes)
    {
        add({"--perms", "1777", "--size", std::to_string(max_bytes), "--tmpfs", path});
    }

private:
    std::vector<std::string>& words_;
};

// For each path that is mounted bubblewrap reads the list of all mounts of the machine. So links are made
// where the system has links, and small files are copied.
void show_system(Words& words, Visible const& visible)
{
    auto const& links = visible.system_links;
    for (std::filesystem::path const folder : system_folders()) {
        auto const link =
            std::find_if(links.begin(), links.end(), [&](auto const& each) { return each.first == folder; });
        if (link != links.end())
            words.link(folder, link->second);
        else
            words.show(folder);
    }
    int descriptor = visible.first_copied;
    for (auto const& file : visible.copied)
        words.copy(descriptor++, file);
    for (std::filesystem::path const file : system_files())
        if (std::find(visible.copied.begin(), visible.copied.end(), file) == visible.copied.end())
            words.show(file);
}

bool is_below(std::filesystem::path const& path, std::filesystem::path const& folder)
{
    return std::mismatch(folder.begin(), folder.end(), path.begin(), path.end()).first == folder.end();
}

/// What is below another one is seen with it.
void show_read_only(Words& words, std::vector<std::filesystem::path> const& paths)
{
    for (auto path = paths.begin(); path != paths.end(); ++path)
        if (!is_below(*path, "/usr") &&
            std::none_of(paths.begin(), path, [&](auto const& before) { return is_below(*path, before); }))
            words.show(*path);
}

} // namespace

std::vector<std::string> bubblewrap_command(std::filesystem::path const& bubblewrap, Visible const& visible,
                                            std::vector<std::string> const& argv)
{
    std::vector<std::string> command{bubblewrap.native()};
    Words words(command);
    words.add({"--unshare-user", "--disable-userns", "--unshare-pid", "--unshare-ipc", "--unshare-uts",
               "--unshare-cgroup-try"});
    words.add({"--die-with-parent", "--new-session", "--cap-drop", "ALL", "--hostname", "simulation"});
    // bubblewrap does all this in the order of its arguments: what comes later lies over what was before.
    show_system(words, visible);
    words.add({"--proc", "/proc", "--dev", "/dev"});
    for (auto const* folder : kernel_settings)
        words.show(folder);
    words.make_folder("/dev/shm", shared_memory_bytes);
    for (auto const& device : visible.devices)
        words.add({"--dev-bind-try", device.native(), device.native()});
    if (!visible.devices.empty())
        for (auto const* folder : device_descriptions)
            words.show(folder);
    words.make_folder(sandbox_temporary, visible.temporary_bytes);
    words.add({"--dir", sandbox_home, "--perms", "0700", "--dir", sandbox_runtime});
    if (visible.own_displays)
        words.make_folder(display_folder, max_display_bytes);
    if (auto const socket = display_socket(visible.display); !socket.empty())
        words.show(socket);
    if (!visible.x_authority.empty())
        words.show(visible.x_authority);
    if (!visible.resolver.empty())
        words.add({"--ro-bind-try", visible.resolver.native(), "/etc/resolv.conf"});
    show_read_only(words, visible.read_only);
    words.add({"--bind", visible.instance.native(), visible.instance.native()});
    // What is left in between, the folders above all of these among it, lies in memory that nobody counts.
    words.add({"--remount-ro", "/", "--remount-ro", "/dev"});
    words.add({"--chdir", visible.directory.native(), "--"});
    command.insert(command.end(), argv.begin(), argv.end());
    return command;
}

} // namespace webots_cloud::core
