#include "controller_address.hpp"

#include "controller_greeting.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::core {
namespace {

constexpr char short_name_mark = '~';
constexpr std::size_t max_robot_name = 512;

bool is_encoded_name(std::string_view name) noexcept
{
    return !name.empty() && name.size() <= max_robot_name &&
           std::all_of(name.begin(), name.end(), [](char c) {
               return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      std::string_view("-._~%").find(c) != std::string_view::npos;
           });
}

/// How long libController makes of it: it encodes once more what is encoded already.
std::size_t encoded_length(std::string_view path) noexcept
{
    constexpr std::size_t length_of_code = 3;
    auto const codes = std::count_if(path.begin(), path.end(), [](char c) { return c == '%' || c == '/'; });
    return path.size() + static_cast<std::size_t>(codes) * (length_of_code - 1);
}

} // namespace

bool ExternRobots::add(std::string robot)
{
    bool const is_new = names_.size() < max_robots && std::ranges::find(names_, robot) == names_.end();
    if (is_new)
        names_.push_back(std::move(robot));
    return is_new;
}

std::string ExternRobots::short_name(std::size_t index)
{
    return concat("~", std::to_string(index + 1));
}

std::string ExternRobots::resolve(std::string_view called) const
{
    std::size_t number = 0;
    auto const* const end = called.data() + called.size();
    if (called.starts_with(short_name_mark) && std::ranges::find(names_, called) == names_.end() &&
        std::from_chars(called.data() + 1, end, number).ptr == end && number > 0 && number <= names_.size())
        return names_[number - 1];
    return std::string(called);
}

std::optional<std::string> extern_robot_in(std::string_view line)
{
    constexpr std::string_view end_of_scheme = "://";
    if (!line.starts_with("tcp://") && !line.starts_with("ipc://"))
        return std::nullopt;
    auto const slash = line.find('/', line.find(end_of_scheme) + end_of_scheme.size());
    if (slash == std::string_view::npos || !is_encoded_name(line.substr(slash + 1)))
        return std::nullopt;
    return std::string(line.substr(slash + 1));
}

std::string controller_place(std::string_view configured, std::string_view base, std::uint16_t port)
{
    constexpr std::string_view end_of_scheme = "://";
    if (!configured.empty())
        return std::string(configured);
    base.remove_prefix(base.find(end_of_scheme) + end_of_scheme.size());
    auto const end = base.starts_with('[') ? base.find(']') + 1 : base.find_first_of(":/");
    return concat(base.substr(0, end), ":", std::to_string(port));
}

std::string controller_url(std::string_view place, std::string_view key, ExternRobots const& robots,
                           std::size_t index)
{
    auto url = concat(place, "/", key, "/", robots.names().at(index));
    if (encoded_length(std::string_view(url).substr(url.find('/') + 1)) > max_encoded_name)
        url = concat(place, "/", key, "/", ExternRobots::short_name(index));
    return concat("tcp://", url);
}

} // namespace webots_cloud::core
