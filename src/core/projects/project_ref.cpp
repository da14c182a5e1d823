// Takes the addresses of worlds apart, as people copy them from forges: which forge, whose repository,
// which ref and folder, which world. Each part becomes a path or an address later, so each is checked
// here.
#include <webots_cloud/project_ref.hpp>

#include "core/forge_link.hpp"
#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"
#include "repository_policy.hpp"

#include <algorithm>
#include <optional>

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

Failure bad_part(Refused which, std::string_view part)
{
    return refused(which, {{"part", core::printable(part, 60)}});
}

bool is_world_file(std::string_view name)
{
    constexpr std::string_view extension = ".wbt";
    return name.ends_with(extension) && name.size() > extension.size();
}

/// What a link lacks that leads to no world.
std::optional<Failure> why_no_world(std::string_view path, core::ForgeLink const* link)
{
    auto const all = core::split(path, '/');
    bool const is_front_page = !link && (all.size() == 2 || (all.size() == 3 && all.back().empty()));
    auto const parts = link ? core::split(link->rest, '/') : std::vector<std::string_view>{""};
    auto const file = parts.back();
    if (is_front_page || (link && link->view == core::LinkView::folder && !file.ends_with(".wbt")))
        return refused(Refused::address_of_folder);
    if (!link && all.size() >= 6)
        return refused(Refused::address_without_blob, {{"found", core::printable(all[2], 60)}});
    if (!link || parts.size() < 2)
        return refused(Refused::address_too_short);
    if (parts.size() < 3 && !is_world_file(file))
        return refused(Refused::address_too_short);
    if (parts.size() < 3 || parts[parts.size() - 2] != "worlds")
        return refused(Refused::address_not_in_worlds,
                       {{"world", core::printable(is_world_file(file) ? file : "world.wbt", 60)}});
    if (!is_world_file(file))
        return refused(Refused::address_without_world);
    return std::nullopt;
}

std::optional<Failure> bad_name(ProjectRef const& project)
{
    for (auto const part : core::split(project.owner, '/'))
        if (!is_forge_name(part))
            return bad_part(Refused::address_owner, part);
    if (!is_forge_name(project.repository) || core::without_dot_git(project.repository) != project.repository)
        return bad_part(Refused::address_repository, project.repository);
    // Where the ref ends is unknown yet, so its parts obey the rule for files and folders, too.
    for (auto const part : core::split(project.ref_and_folder, '/'))
        if (!core::is_safe_file_name(part))
            return bad_part(Refused::address_name, part);
    if (!project.world.empty() && !core::is_safe_file_name(project.world))
        return bad_part(Refused::address_name, project.world);
    return std::nullopt;
}

} // namespace

ForgeKind kind_of_forge(std::string_view url) noexcept
{
    if (url.empty()) // as the site of a kind that has none
        return ForgeKind::unknown;
    auto const* const found = std::ranges::find(forge_kinds, url, &ForgeKindRow::site);
    return found == forge_kinds.end() ? ForgeKind::unknown : found->kind;
}

std::string_view ProjectRef::folder_after_ref() const noexcept
{
    return std::string_view(ref_and_folder).substr(std::min(ref_and_folder.find('/'), ref_and_folder.size()));
}

std::string ProjectRef::clone_url() const
{
    return concat(forge, "/", owner, "/", repository, ".git");
}

std::string ProjectRef::address() const
{
    constexpr std::string_view heads = "refs/heads/";
    std::string_view brief = ref_and_folder;
    if (brief.starts_with(heads) && brief.size() > heads.size())
        brief.remove_prefix(heads.size());
    return concat(forge, "/", owner, "/", repository, "/blob/", brief, "/worlds/", world);
}

namespace {

/// `usual`: `url` at the usual host of its forge.
result<ForgeAddress> forge_at(std::string_view usual, std::string_view url,
                              std::vector<ForgeAddress> const& forges)
{
    constexpr std::size_t max_url_bytes = 2048; // the text says characters: in an address that is encoded as
                                                // it should be, that is the same
    if (url.size() > max_url_bytes)
        return refused(Refused::address_too_long);
    auto const forge = std::find_if(forges.begin(), forges.end(), [&](ForgeAddress const& base) {
        return usual.size() > base.url.size() && usual.starts_with(base.url) && usual[base.url.size()] == '/';
    });
    if (forge == forges.end()) {
        std::string expected;
        for (auto const& base : forges)
            expected += concat(expected.empty() ? "" : " or ", base.url, "/");
        if (forges.empty())
            expected = "the address of a forge, and none is configured";
        return refused(Refused::foreign_site, {{"url", core::printable(url, 200)}, {"sites", expected}});
    }
    return *forge;
}

/// A URL on a forge.
struct PlacedUrl
{
    ForgeAddress forge;
    std::string path; ///< Decoded, without the slash after the forge.
};

result<PlacedUrl> place_of(std::string_view url, std::vector<ForgeAddress> const& forges)
{
    auto const usual = core::usual_address(url);
    auto forge = forge_at(usual, url, forges);
    if (!forge)
        return forge.error();
    PlacedUrl place;
    auto const location = core::without_query(usual);
    if (!core::percent_decode(location.substr(std::min(location.size(), forge->url.size() + 1)), place.path))
        return refused(Refused::address_malformed);
    place.forge = std::move(*forge);
    return place;
}

/// `names`: owner or groups, and repository.
ProjectRef project_named(std::string_view names, std::string forge)
{
    ProjectRef project;
    auto const repository = names.rfind('/');
    project.forge = std::move(forge);
    project.owner = names.substr(0, repository);
    project.repository = names.substr(repository + 1);
    return project;
}

/// Owner and repository; of GitLab's more.
bool are_names(std::string_view names, ForgeKind kind)
{
    auto const count = core::split(names, '/').size();
    bool const has_groups = kind == ForgeKind::gitlab || kind == ForgeKind::unknown;
    return count == 2 || (count > 2 && has_groups);
}

} // namespace

result<ForgeAddress> forge_of(std::string_view url, std::vector<ForgeAddress> const& forges)
{
    return forge_at(core::usual_address(url), url, forges);
}

result<ProjectRef> parse_world_url(std::string_view url, std::vector<ForgeAddress> const& forges)
{
    auto place = place_of(url, forges);
    if (!place)
        return place.error();
    auto const link = core::forge_link(place->path, place->forge.kind);
    if (auto why = why_no_world(place->path, link ? &*link : nullptr))
        return std::move(*why);

    auto project = project_named(link->names, std::move(place->forge.url));
    auto const file = link->rest.rfind('/');
    project.world = link->rest.substr(file + 1);
    auto const ref_and_folder = link->rest.substr(0, link->rest.rfind('/', file - 1));
    project.ref_and_folder = concat(link->ref_space, ref_and_folder);
    if (auto bad = bad_name(project))
        return std::move(*bad);
    return project;
}

result<ProjectRef> parse_folder_url(std::string_view url, std::vector<ForgeAddress> const& forges)
{
    auto place = place_of(url, forges);
    if (!place)
        return place.error();
    auto& path = place->path;
    while (path.ends_with('/'))
        path.pop_back();
    auto const link = core::forge_link(path, place->forge.kind);
    auto const names = link ? link->names : std::string_view(path);
    if (!are_names(names, place->forge.kind))
        return refused(Refused::address_without_folder);
    auto project = project_named(names, std::move(place->forge.url));
    project.repository = core::without_dot_git(project.repository);
    project.ref_and_folder = link && !link->rest.empty() ? concat(link->ref_space, link->rest) : "HEAD";
    auto const file = project.ref_and_folder.rfind('/');
    if (link && link->view == core::LinkView::file && file != std::string::npos)
        project.ref_and_folder.resize(file);
    if (auto bad = bad_name(project))
        return std::move(*bad);
    return project;
}

} // namespace webots_cloud
