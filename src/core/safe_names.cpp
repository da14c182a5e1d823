#include "safe_names.hpp"

#include "core/text.hpp"

#include <webots_cloud/transport/http.hpp>

#include <algorithm>
#include <array>
#include <string>

namespace webots_cloud::core {
namespace {

/// The UTF-8 of code points that HFS+ leaves out when it compares names.
constexpr std::array<std::string_view, 17> ignored_by_hfs{
    "\u200c", "\u200d", "\u200e", "\u200f", "\u202a", "\u202b", "\u202c", "\u202d", "\u202e",
    "\u206a", "\u206b", "\u206c", "\u206d", "\u206e", "\u206f", "\ufeff", "\u2060"};

/// Whether one of them may begin with this byte.
constexpr bool may_be_ignored(char first) noexcept
{
    return first == ignored_by_hfs.front().front() || first == '\xef';
}

constexpr bool may_begin_dot_git(char first) noexcept
{
    return first == '.' || first == 'g' || first == 'G' || may_be_ignored(first);
}

std::string without_ignored(std::string_view name)
{
    if (std::none_of(name.begin(), name.end(), may_be_ignored)) // nearly every name
        return std::string(name);
    std::string rest;
    while (!name.empty()) {
        auto const ignored = std::find_if(ignored_by_hfs.begin(), ignored_by_hfs.end(),
                                          [&](std::string_view point) { return name.starts_with(point); });
        if (ignored == ignored_by_hfs.end())
            rest += name.front();
        name.remove_prefix(ignored == ignored_by_hfs.end() ? 1 : ignored->size());
    }
    return rest;
}

bool is_control(char c) noexcept
{
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
}

} // namespace

bool is_dot_git(std::string_view name)
{
    if (name.empty() || !may_begin_dot_git(name.front()))
        return false;
    auto const plain = without_ignored(name);
    auto word = std::string_view(plain);
    word = word.substr(0, word.find(':')); // NTFS: `.git::$INDEX_ALLOCATION` is the folder itself
    while (word.ends_with('.') || word.ends_with(' '))
        word.remove_suffix(1);
    return equal_ignoring_case(word, ".git") || equal_ignoring_case(word, "git~1");
}

bool is_harmless_file_name(std::string_view name)
{
    auto const forbidden = [](char c) { return c == '/' || c == '\\' || c == '\0'; };
    return !name.empty() && name.size() <= max_file_name && name != "." && name != ".." &&
           std::none_of(name.begin(), name.end(), forbidden) &&
           !(may_begin_dot_git(name.front()) && is_dot_git(name));
}

bool is_safe_file_name(std::string_view name)
{
    return is_harmless_file_name(name) && is_utf8(name) && std::none_of(name.begin(), name.end(), is_control);
}

bool is_runnable_name(std::string_view name) noexcept
{
    return name.ends_with(".py") || name.find('.') == std::string_view::npos;
}

void tell_forbidden(std::vector<std::string>& told, std::string_view path)
{
    constexpr std::size_t shown = 200;
    if (told.size() == max_forbidden)
        return;
    auto text = printable(path, shown);
    if (std::find(told.begin(), told.end(), text) == told.end())
        told.push_back(std::move(text));
}

bool link_stays_inside(std::string_view target, std::size_t depth)
{
    if (target.empty() || target.size() > 1023 || target.front() == '/' ||
        target.find('\0') != std::string_view::npos)
        return false;
    bool descending = false;
    for (auto const part : split(target, '/')) {
        if (part == "..") {
            if (descending || depth == 0)
                return false;
            --depth;
        } else if (!part.empty() && part != ".") {
            descending = true;
        }
    }
    return true;
}

} // namespace webots_cloud::core
