#include <webots_cloud/project_ref.hpp>

#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"
#include "repository_policy.hpp"

#include <algorithm>

namespace webots_cloud {
namespace {

using core::concat;
using core::Refused;
using core::refused;

bool is_alphanumeric(char c) noexcept
{
    return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
}

/// Owners and repositories: what some forge allows (docs/access.md). Names become paths and addresses, never
/// arguments of a command, so they may begin with a hyphen.
bool is_forge_name(std::string_view name)
{
    constexpr std::size_t longest = 255;          // of a group of GitLab
    bool const is_hidden = name.starts_with('.'); // `.github` is a repository
    return !name.empty() && name.size() <= longest &&
           !(is_hidden && (name == "." || name == ".." || core::is_dot_git(name))) &&
           std::all_of(name.begin(), name.end(),
                       [](char c) { return is_alphanumeric(c) || c == '-' || c == '_' || c == '.'; });
}

Failure bad_part(std::string_view what, std::string_view part)
{
    return refused(Refused::address_part, {{"part", core::printable(part, 60)}, {"what", what}});
}

} // namespace

std::string ProjectRef::clone_url() const
{
    return concat(forge, "/", owner, "/", repository, ".git");
}

result<std::string> forge_of(std::string_view url, std::vector<std::string> const& forges)
{
    constexpr std::size_t max_url_bytes = 2048; // the text says characters: in an address that is encoded as
                                                // it should be, that is the same
    if (url.size() > max_url_bytes)
        return refused(Refused::address_too_long);
    auto const forge = std::find_if(forges.begin(), forges.end(), [&](std::string const& base) {
        return url.size() > base.size() && url.starts_with(base) && url[base.size()] == '/';
    });
    if (forge == forges.end()) {
        std::string expected;
        for (auto const& base : forges)
            expected += concat(expected.empty() ? "" : " or ", base, "/");
        if (forges.empty())
            expected = "the address of a forge, and none is configured";
        return refused(Refused::foreign_site, {{"url", core::printable(url, 200)}, {"sites", expected}});
    }
    return *forge;
}

result<ProjectRef> parse_world_url(std::string_view url, std::vector<std::string> const& forges)
{
    auto forge = forge_of(url, forges);
    if (!forge)
        return forge.error();
    auto const location = core::without_query(url);
    std::string path;
    if (!core::percent_decode(location.substr(std::min(location.size(), forge->size() + 1)), path))
        return refused(Refused::address_malformed);
    auto const parts = core::split(path, '/');
    if (parts.size() < 6)
        return refused(Refused::address_too_short);
    if (parts[2] != "blob" && parts[2] != "tree")
        return refused(Refused::address_without_blob, {{"found", core::printable(parts[2], 60)}});
    if (parts[parts.size() - 2] != "worlds")
        return refused(Refused::address_without_worlds);
    if (!parts.back().ends_with(".wbt") || parts.back().size() == 4)
        return refused(Refused::address_without_world);

    ProjectRef project;
    project.forge = std::move(*forge);
    project.owner = parts[0];
    project.repository = parts[1];
    project.world = parts.back();
    if (!is_forge_name(project.owner))
        return bad_part("name of an owner", project.owner);
    if (!is_forge_name(project.repository) || core::without_dot_git(project.repository) != project.repository)
        return bad_part("name of a repository", project.repository);
    // Where the ref ends is unknown yet, so its parts obey the rule for files and folders, too.
    for (std::size_t i = 3; i < parts.size(); ++i)
        if (!core::is_safe_file_name(parts[i]))
            return bad_part("name of a branch, folder or file", parts[i]);
    auto const first = static_cast<std::size_t>(parts[3].data() - path.data());
    auto const last = static_cast<std::size_t>(parts[parts.size() - 2].data() - path.data()) - 1;
    project.ref_and_folder = path.substr(first, last - first);
    return project;
}

} // namespace webots_cloud
