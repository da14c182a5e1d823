// Whose worlds run here: what the policy has judged is what will be fetched, however the address spells it.
#include "fuzz.hpp"

#include "core/git/git_refs.hpp"
#include "core/projects/repository_policy.hpp"
#include "core/text.hpp"

#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/http.hpp>

#include <optional>
#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

constexpr std::string_view forge = "https://github.com";

std::string hash(char digit)
{
    return std::string(40, digit);
}

core::GitRef ref(std::string name, char digit)
{
    core::GitRef made;
    made.name = std::move(name);
    made.id = *core::git_object_id(hash(digit));
    return made;
}

/// Each on a commit of its own, so that the commit says which was meant.
std::vector<core::GitRef> const& refs()
{
    static std::vector<core::GitRef> const list{ref("HEAD", 'a'), ref("refs/heads/main", 'a'),
                                                ref("refs/heads/feature/x", 'b'), ref("refs/tags/v1", 'c'),
                                                ref("refs/heads/other", 'd')};
    return list;
}

std::string encoded(std::string_view text)
{
    constexpr std::string_view digits = "0123456789ABCDEF";
    constexpr std::string_view plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789/-_.";
    std::string safe;
    for (char const c : text) {
        auto const byte = static_cast<unsigned char>(c);
        if (plain.find(c) != std::string_view::npos)
            safe += c;
        else
            safe.append("%").append(1, digits[byte >> 4]).append(1, digits[byte & 15]);
    }
    return safe;
}

std::string repository_of(ProjectRef const& project)
{
    return core::concat(project.forge, "/", project.owner, "/", project.repository);
}

core::ForgeOfWorld const forge_of_world(forge, RefMeaning::git);

bool is_refused(std::vector<std::string> blocked, std::string_view url)
{
    core::RepositoryPolicy policy;
    policy.outside.accepted = true;
    policy.rules.blocked = std::move(blocked);
    return core::refusal(policy, url, forge_of_world, 0).has_value();
}

bool is_allowed(std::vector<std::string> allowed, std::string_view url)
{
    core::RepositoryPolicy policy;
    policy.rules.allowed = std::move(allowed);
    return !core::refusal(policy, url, forge_of_world, 0).has_value();
}

/// By the repository that is fetched, and by what contains it.
void check_repository(ProjectRef const& project, std::string_view url)
{
    auto const owner = core::concat(project.forge, "/", project.owner);
    for (auto const& rule :
         {project.forge, owner, repository_of(project), repository_of(project) + "/", project.clone_url()})
        fuzz::require(is_refused({rule}, url));
    for (auto const& rule : {project.forge, owner, repository_of(project)})
        fuzz::require(is_allowed({rule}, url));
    for (auto const& other : {owner + "x", repository_of(project) + "x", repository_of(project) + "/x"}) {
        fuzz::require(!is_allowed({other}, url));
        if (!other.ends_with("/x"))
            fuzz::require(!is_refused({other}, url));
    }
    fuzz::require(
        is_allowed({"https://github.com/good/robots"}, url) ==
        (equal_ignoring_case(project.owner, "good") && equal_ignoring_case(project.repository, "robots")));
}

/// By a branch: whoever gets the commit of a blocked branch has been refused.
void check_branch(ProjectRef const& project, std::string_view url)
{
    auto const fetched = core::resolve_ref(project.ref_and_folder, refs());
    if (!fetched)
        return;
    for (auto const* name : {"main", "feature/x", "v1"}) {
        auto const blocked = core::resolve_ref(name, refs());
        fuzz::require(blocked.has_value());
        if (fetched->commit == blocked->commit)
            fuzz::require(is_refused({core::concat(repository_of(project), "/blob/", name)}, url));
    }
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto rest = fuzz::text_of(data, size);
    std::string const rule(fuzz::take(rest, fuzz::take_byte(rest)));
    auto const url = rest;
    std::vector<ForgeAddress> const forges{std::string(forge)};
    if (!forge_of(url, forges))
        return 0;
    (void)is_refused({rule}, url);
    auto const project = parse_world_url(url, forges);
    if (!project)
        return 0;
    check_repository(*project, url);
    check_branch(*project, url);
    // Any rule says the same of the address and of what was understood of it.
    auto const plain = core::concat(repository_of(*project), "/blob/", encoded(project->ref_and_folder),
                                    "/worlds/", encoded(project->world));
    fuzz::require(is_refused({rule}, url) == is_refused({rule}, plain));
    fuzz::require(is_allowed({rule}, url) == is_allowed({rule}, plain));
    return 0;
}
