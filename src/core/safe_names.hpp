// Which names and links of others (repositories, archives, addresses, messages) may become files here.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Bytes of the name of one file or folder: what file systems take.
constexpr std::size_t max_file_name = 255;

/// True for spellings of `.git` on any file system: other case, dots, spaces or streams at the end, `git~1`,
/// code points that HFS+ ignores.
bool is_dot_git(std::string_view name);

/// True when a file or folder of somebody's project may have this name: one path segment of at most
/// `max_file_name` bytes, without backslashes and zeros, neither `.` nor `..`, and no `.git`. Other bytes are
/// the owner's business: `Icon` and a carriage return is a file of macOS, and old names are in Latin-1. So it
/// is printed by `printable` only.
bool is_harmless_file_name(std::string_view name);

/// True when a name that somebody writes to us, in an address or a message, is that of a file: a harmless
/// one, and text, which is well-formed UTF-8 without control characters.
bool is_safe_file_name(std::string_view name);

/// True for what may be run where nothing is known of permissions: files that end in `.py`, and names without
/// an extension, as programs and folders have.
bool is_runnable_name(std::string_view name) noexcept;

/// Of how many files that are left out for their names the author of a project is told.
constexpr std::size_t max_forbidden = 16;

/// Adds `path`, as it may be shown, to those of which the author is told, unless it is there or they are
/// enough.
void tell_forbidden(std::vector<std::string>& told, std::string_view path);

/// True when a symbolic link that lies `depth` folders below the root of what is given out provably stays
/// inside: its target is relative, begins with at most `depth` parts `..` and has none after that.
bool link_stays_inside(std::string_view target, std::size_t depth);

} // namespace webots_cloud::core
