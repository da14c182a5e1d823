#include "git_index.hpp"

#include "core/git/git_names.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::adapters {
namespace {

using core::concat;
using Kind = core::GitTreeEntry::Kind;

constexpr std::string_view first_line = "webots_cloud folder 2"; // 1: of commits that may be a stranger's
constexpr std::string_view last_line = "end";
constexpr std::string_view letters = "fxld"; // in the order of Kind

result<GitIndex> malformed()
{
    return Failure(errc::protocol_error, "the index of a folder in the cache is malformed");
}

bool is_safe_path(std::string_view path)
{
    auto const parts = core::split(path, '/');
    return std::all_of(parts.begin(), parts.end(), core::is_safe_file_name);
}

/// `<letter> <id> <size> <path>`
bool parse_entry(std::string_view line, GitIndexEntry& entry)
{
    auto const kind = line.empty() ? std::string_view::npos : letters.find(line.front());
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
    entry.path = line.substr(static_cast<std::size_t>(end - line.data()) + 1);
    return is_safe_path(entry.path);
}

} // namespace

std::string write_index(GitIndex const& index)
{
    auto text = concat(first_line, "\n");
    for (auto const& entry : index.entries) {
        text += letters[static_cast<std::size_t>(entry.kind)];
        text.append(concat(" ", to_hex(entry.id), " ", std::to_string(entry.size), " ", entry.path, "\n"));
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
    for (std::size_t i = 1; i + 2 < lines.size(); ++i) {
        GitIndexEntry entry;
        if (!parse_entry(lines[i], entry))
            return malformed();
        index.bytes += entry.kind == Kind::folder ? 0 : entry.size;
        index.entries.push_back(std::move(entry));
    }
    return index;
}

} // namespace webots_cloud::adapters
