#include "mounts.hpp"

#include "mount_thread.hpp"

#include "core/text.hpp"

#include <sys/mount.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <iterator>

namespace webots_cloud::adapters {
namespace {

bool is_octal(char c) noexcept
{
    return c >= '0' && c <= '7';
}

/// Undoes how the kernel writes spaces, tabs, newlines and backslashes: `\040`.
std::string unescaped(std::string_view text)
{
    std::string plain;
    for (std::size_t i = 0; i < text.size(); ++i) {
        auto const digits = text.substr(i + 1, 3);
        if (text[i] == '\\' && digits.size() == 3 && std::all_of(digits.begin(), digits.end(), is_octal)) {
            plain += static_cast<char>((digits[0] - '0') * 64 + (digits[1] - '0') * 8 + (digits[2] - '0'));
            i += 3;
        } else {
            plain += text[i];
        }
    }
    return plain;
}

/// Returns: `errno`; 0: it is done.
int unmount(std::string const& path)
{
    return mount_elsewhere(
        [&] { return ::umount2(path.c_str(), MNT_DETACH | UMOUNT_NOFOLLOW) == 0 ? 0 : errno; });
}

} // namespace

std::vector<std::string> mounts_below(std::string_view mountinfo, std::string_view directory)
{
    constexpr std::size_t mount_point = 4; // the fifth column
    std::vector<std::string> found;
    for (auto const line : core::split(mountinfo, '\n')) {
        auto const columns = core::split(line, ' ');
        if (columns.size() <= mount_point)
            continue;
        auto path = unescaped(columns[mount_point]);
        if (path == directory || (path.starts_with(directory) && path[directory.size()] == '/'))
            found.push_back(std::move(path));
    }
    std::reverse(found.begin(), found.end()); // listed in the order of mounting
    return found;
}

result<> unmount_below(std::filesystem::path const& directory)
{
    std::error_code failed;
    auto const parent =
        std::filesystem::canonical(std::filesystem::absolute(directory).parent_path(), failed);
    if (failed)
        return {};
    std::ifstream file("/proc/self/mountinfo");
    std::string const mountinfo(std::istreambuf_iterator<char>(file), {});
    for (auto const& path : mounts_below(mountinfo, (parent / directory.filename()).string()))
        if (int const error = unmount(path); error != 0)
            return Failure(errc::unavailable,
                           core::concat("can't unmount ", path, ": ",
                                        std::error_code(error, std::generic_category()).message()));
    return {};
}

} // namespace webots_cloud::adapters
