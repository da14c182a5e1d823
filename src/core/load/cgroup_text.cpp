#include "cgroup_text.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::core {
namespace {

/// Cuts off what is before the first separator, and that too.
std::string_view next_field(std::string_view& text, char separator) noexcept
{
    auto const field = text.substr(0, text.find(separator));
    text.remove_prefix(std::min(field.size() + 1, text.size()));
    return field;
}

std::string_view next_line(std::string_view& text) noexcept
{
    return next_field(text, '\n');
}

} // namespace

std::string_view own_cgroup(std::string_view text, std::string_view controller) noexcept
{
    while (!text.empty()) {
        auto line = next_line(text); // <number>:<controllers>:<path>
        next_field(line, ':');
        auto controllers = next_field(line, ':');
        if (controller.empty() && controllers.empty())
            return line;
        while (!controllers.empty())
            if (next_field(controllers, ',') == controller)
                return line;
    }
    return {};
}

std::optional<std::uint64_t> cgroup_number(std::string_view text) noexcept
{
    text = trim(text);
    std::uint64_t value = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size())
        return std::nullopt;
    return value;
}

std::optional<double> processor_limit(std::string_view text) noexcept
{
    auto const blank = text.find(' ');
    if (blank == std::string_view::npos)
        return std::nullopt;
    auto const quota = cgroup_number(text.substr(0, blank));
    auto const period = cgroup_number(text.substr(blank));
    if (!quota || !period || *period == 0)
        return std::nullopt;
    return static_cast<double>(*quota) / static_cast<double>(*period);
}

std::uint64_t cgroup_value(std::string_view text, std::string_view key) noexcept
{
    while (!text.empty()) {
        auto const line = next_line(text);
        if (line.starts_with(key) && line.substr(key.size()).starts_with(' '))
            return cgroup_number(line.substr(key.size())).value_or(0);
    }
    return 0;
}

} // namespace webots_cloud::core
