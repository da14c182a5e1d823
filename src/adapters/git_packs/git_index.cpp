// The text of an index on disk. It may be damaged: what does not agree with itself is no index.
#include "git_index.hpp"

#include "git_digest.hpp"

#include "core/git/git_layout.hpp"
#include "core/git/git_lfs_pointer.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::adapters {
namespace {

using core::concat;
using Kind = core::GitTreeEntry::Kind;

constexpr std::string_view first_line =
    "webots_cloud folder 4"; // a cache of another version is fetched again
constexpr std::string_view last_line = "end";
constexpr std::string_view letters = "fxld"; // in the order of Kind
constexpr std::string_view large_letters = "FX";
constexpr std::string_view forbidden_mark = "- ";

result<GitIndex> malformed()
{
    return Failure(errc::protocol_error, "the index of a folder in the cache is malformed");
}

bool is_safe_path(std::string_view path)
{
    auto const parts = core::split(path, '/');
    return std::all_of(parts.begin(), parts.end(), core::is_harmless_file_name);
}

/// One line is one path: a newline in it is written `\n`, since no name has a backslash of its own.
std::string written(std::string_view path)
{
    std::string text;
    for (char const c : path)
        text.append(c == '\n' ? "\\n" : std::string_view(&c, 1));
    return text;
}

/// The path; what `written` does not write stays as it is, and is no path.
std::string read(std::string_view text)
{
    constexpr std::string_view newline = "\\n";
    std::string path(text);
    for (auto at = path.find(newline); at != std::string::npos; at = path.find(newline, at + 1))
        path.replace(at, newline.size(), "\n");
    return path;
}

std::string to_hex(std::string_view text)
{
    constexpr char digits[] = "0123456789abcdef";
    std::string hex;
    hex.reserve(2 * text.size());
    for (unsigned char const byte : text) {
        hex += digits[byte >> 4];
        hex += digits[byte & 15];
    }
    return hex;
}

std::string from_hex(std::string_view hex)
{
    std::string text;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2)
        text += static_cast<char>(core::hex_digit(hex[i]) * 16 + core::hex_digit(hex[i + 1]));
    return text;
}

/// Takes the pointer off; false when it is none, or not the one of the entry.
bool take_pointer(std::string_view& rest, GitIndexEntry& entry)
{
    auto const hex = rest.substr(0, rest.find(' '));
    entry.pointer = from_hex(hex);
    auto const pointer = core::parse_lfs_pointer(entry.pointer);
    if (!pointer || pointer->size != entry.size || to_hex(entry.pointer) != hex || hex.size() == rest.size())
        return false;
    auto const header = concat("blob ", std::to_string(entry.pointer.size()));
    GitDigest digest;
    digest.update({header.c_str(), header.size() + 1}); // with the zero
    digest.update(entry.pointer);
    rest.remove_prefix(hex.size() + 1);
    return digest.finish() == entry.id;
}

/// `<letter> <id> <size> <path>`, or of a large file `<letter> <id> <size> <pointer in hex> <path>`
bool parse_entry(std::string_view line, GitIndexEntry& entry)
{
    auto const large_kind = line.empty() ? std::string_view::npos : large_letters.find(line.front());
    auto const is_large = large_kind != std::string_view::npos;
    auto const kind = line.empty() || is_large ? large_kind : letters.find(line.front());
    constexpr std::size_t id_at = 2;
    constexpr std::size_t size_at = id_at + 41;
    if (kind == std::string_view::npos || line.size() < size_at)
        return false;
    auto const id = core::git_object_id(line.substr(id_at, 40));
    auto const [end, failed] = std::from_chars(line.data() + size_at, line.data() + line.size(), entry.size);
    if (!id || failed != std::errc() || end == line.data() + line.size() || *end != ' ')
        return false;
    entry.kind = static_cast<Kind>(kind);
    entry.id = *id;
    auto rest = line.substr(static_cast<std::size_t>(end - line.data()) + 1);
    if (is_large && !take_pointer(rest, entry))
        return false;
    entry.path = read(rest);
    return is_safe_path(entry.path);
}

} // namespace

std::string write_index(GitIndex const& index)
{
    auto text = concat(first_line, "\n");
    for (auto const& path : index.forbidden)
        text.append(concat(forbidden_mark, path, "\n"));
    for (auto const& entry : index.entries) {
        auto const is_large = !entry.pointer.empty();
        text += (is_large ? large_letters : letters)[static_cast<std::size_t>(entry.kind)];
        text.append(concat(" ", to_hex(entry.id), " ", std::to_string(entry.size), " "));
        if (is_large)
            text.append(to_hex(entry.pointer)).append(" ");
        text.append(written(entry.path)).append("\n");
    }
    return text.append(last_line).append("\n");
}

result<GitIndex> parse_index(std::string_view text)
{
    auto const lines = core::split(text, '\n');
    if (lines.size() < 3 || lines.front() != first_line || lines[lines.size() - 2] != last_line ||
        !lines.back().empty())
        return malformed();
    GitIndex index;
    std::size_t i = 1;
    for (; lines[i].starts_with(forbidden_mark); ++i) {
        auto const path = lines[i].substr(forbidden_mark.size());
        if (!core::is_printable(path) || index.forbidden.size() == core::max_forbidden)
            return malformed();
        index.forbidden.emplace_back(path);
    }
    for (; i + 2 < lines.size(); ++i) {
        GitIndexEntry entry;
        if (!parse_entry(lines[i], entry))
            return malformed();
        index.bytes += entry.kind == Kind::folder ? 0 : entry.size;
        index.entries.push_back(std::move(entry));
    }
    return index;
}

} // namespace webots_cloud::adapters
