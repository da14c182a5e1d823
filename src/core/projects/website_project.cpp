#include <webots_cloud/website_project.hpp>

#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <array>

namespace webots_cloud {
namespace {

using core::concat;

constexpr std::size_t min_elements = 3;
constexpr std::size_t max_elements = 9;
constexpr std::size_t max_origin_length = 300;
constexpr std::size_t max_path_length = 1024;

bool is_digit(char c) noexcept
{
    return c >= '0' && c <= '9';
}

/// Letters, digits, hyphens and underscores: such a name is no path, no option and no hidden file.
bool is_host_label(std::string_view label)
{
    auto const allowed = [](char c) { return is_digit(c) || (c >= 'a' && c <= 'z') || c == '-' || c == '_'; };
    return !label.empty() && label.size() <= 63 && label.front() != '-' &&
           std::all_of(label.begin(), label.end(), allowed);
}

bool is_host(std::string_view host)
{
    auto const labels = core::split(host, '.');
    return host.size() <= 253 && std::all_of(labels.begin(), labels.end(), is_host_label);
}

std::string_view without_scheme(std::string_view origin)
{
    for (std::string_view const scheme : {"https://", "http://"})
        if (origin.starts_with(scheme))
            return origin.substr(scheme.size());
    return {};
}

bool is_origin(std::string_view origin)
{
    auto const authority = without_scheme(origin);
    auto const colon = authority.find(':');
    return origin.size() <= max_origin_length && is_host(authority.substr(0, colon)) &&
           (colon == std::string_view::npos || core::parse_port(authority.substr(colon + 1)) != 0);
}

bool is_folder(std::string_view path)
{
    auto const parts = core::split(path, '/');
    return path.size() <= max_path_length && std::all_of(parts.begin(), parts.end(), core::is_safe_file_name);
}

bool is_world(std::string_view file)
{
    constexpr std::string_view extension = ".wbt";
    return file.size() > extension.size() && file.ends_with(extension) && core::is_safe_file_name(file);
}

Failure wrong(std::string_view what, std::string_view found)
{
    return {errc::invalid_url, concat("\"", core::printable(found, 60), "\" is no ", what)};
}

} // namespace

std::string WebsiteProject::host() const
{
    auto const authority = without_scheme(origin);
    return std::string(authority.substr(0, authority.find(':')));
}

bool WebsiteProject::may_edit() const noexcept
{
    return user1_id.empty() || !user1_authentication.empty();
}

std::string WebsiteProject::url() const
{
    return concat(origin, "/", project, "/worlds/", world);
}

result<WebsiteProject> parse_init(std::vector<std::string> const& elements)
{
    if (elements.size() < min_elements || elements.size() > max_elements)
        return Failure(errc::invalid_url, concat("\"init\" must have three to nine elements, not ",
                                                 std::to_string(elements.size())));
    WebsiteProject project;
    std::array<std::string*, max_elements> const members{
        &project.origin,   &project.project,    &project.world,
        &project.user1_id, &project.user1_name, &project.user1_authentication,
        &project.user2_id, &project.user2_name, &project.custom_data};
    for (std::size_t i = 0; i < elements.size(); ++i)
        *members[i] = elements[i];
    project.origin = core::lower_case(project.origin);
    if (!is_origin(project.origin))
        return wrong("address of a website, such as https://example.org", elements[0]);
    if (!is_folder(project.project))
        return wrong("name of a project", project.project);
    if (!is_world(project.world))
        return wrong("name of a world file", project.world);
    return project;
}

} // namespace webots_cloud
