// Judges what will be fetched, not how its address is written: rule and world are taken apart into the same
// segments first. A rule that allows has to fit surely; one that blocks has to fit every way to write the
// same thing.
#include "repository_policy.hpp"

#include "core/forge_link.hpp"
#include "core/git/git_object_id.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <webots_cloud/project_ref.hpp>
#include <webots_cloud/transport/http.hpp>

#include <algorithm>
#include <array>

namespace webots_cloud::core {
namespace {

using Segments = std::vector<std::string>;

/// An address in the form in which addresses are compared.
struct Location
{
    std::string scheme; ///< In lower case; empty: none.
    std::string host;   ///< In lower case, with its port unless that is the usual one of the scheme.
    Segments path;
};

Segments normal_segments(std::string_view path)
{
    Segments segments;
    for (auto const part : split(path, '/')) {
        if (part == ".." && !segments.empty())
            segments.pop_back();
        else if (!part.empty() && part != "." && part != "..")
            segments.emplace_back(part);
    }
    return segments;
}

std::string normal_host(std::string_view authority, std::string_view scheme)
{
    auto host = authority.substr(authority.rfind('@') + 1); // npos + 1 is 0: no user is named
    std::string_view const usual_port = scheme == "https" ? ":443" : scheme == "http" ? ":80" : "";
    if (host.ends_with(usual_port))
        host.remove_suffix(usual_port.size());
    while (host.ends_with('.'))
        host.remove_suffix(1);
    return lower_case(host);
}

/// `decoded`: no percent-encodings are left.
Location location_of(std::string_view decoded)
{
    Location location;
    constexpr std::string_view mark = "://";
    if (auto const end = decoded.find(mark); end != std::string_view::npos) {
        location.scheme = lower_case(decoded.substr(0, end));
        decoded.remove_prefix(end + mark.size());
    }
    auto const slash = std::min(decoded.find('/'), decoded.size());
    location.host = normal_host(decoded.substr(0, slash), location.scheme);
    location.path = normal_segments(decoded.substr(slash));
    return location;
}

std::optional<Location> location_of_rule(std::string_view rule)
{
    auto const usual = usual_address(trim(rule));
    std::string decoded;
    if (!percent_decode(without_query(usual), decoded))
        return std::nullopt;
    auto location = location_of(decoded);
    if (location.host.empty() && location.scheme.empty())
        return std::nullopt;
    return location;
}

/// `https://` and `https:`, as a prefix of everything that begins so.
bool is_scheme_of(Location const& rule, Location const& forge)
{
    if (!rule.path.empty() || forge.scheme.empty())
        return false;
    return rule.host.empty() ? rule.scheme == forge.scheme : concat(forge.scheme, ":") == rule.host;
}

using Same = bool (*)(std::string_view, std::string_view);

bool same_without_case(std::string_view left, std::string_view right)
{
    return equal_ignoring_case(left, right);
}

bool same_exactly(std::string_view left, std::string_view right)
{
    return left == right;
}

bool begins_with(Segments const& all, Segments const& beginning, Same same)
{
    return beginning.size() <= all.size() &&
           std::equal(beginning.begin(), beginning.end(), all.begin(), same);
}

/// What a rule's address says after that of the forge: owner, repository and so on. Empty: the rule names the
/// forge, or a site that the forge is a part of, and so all of its worlds. `nullopt`: it names another place.
std::optional<Segments> segments_on_forge(Location const& rule, Location const& forge, Same same)
{
    if (begins_with(forge.path, rule.path, same))
        return Segments();
    if (!begins_with(rule.path, forge.path, same))
        return std::nullopt;
    return Segments(rule.path.begin() + static_cast<std::ptrdiff_t>(forge.path.size()), rule.path.end());
}

Segments without_dot_gits(Segments names)
{
    for (std::size_t i = 1; i < names.size(); ++i)
        names[i] = without_dot_git(names[i]);
    return names;
}

/// Segments after those of a forge, told apart.
struct Parts
{
    Segments names;                  ///< Owner or groups, and repository.
    std::optional<Segments> in_view; ///< The ref and what is in it; `nullopt`: they name no file or folder.
};

Parts parts_of(Segments const& segments, ForgeKind kind)
{
    std::string path;
    for (auto const& segment : segments)
        path += concat(path.empty() ? "" : "/", segment);
    auto const link = forge_link(path, kind);
    Parts parts;
    parts.names = without_dot_gits(link ? normal_segments(link->names) : segments);
    if (link)
        parts.in_view = normal_segments(concat(link->ref_space, link->rest));
    return parts;
}

/// Of a world's address.
Parts parts_of_world(std::string_view url, ForgeOfWorld const& forge)
{
    if (auto const world = parse_world_url(url, {ForgeAddress(std::string(forge.url), forge.kind)})) {
        Parts parts;
        parts.names = normal_segments(concat(world->owner, "/", world->repository));
        parts.in_view = normal_segments(concat(world->ref_and_folder, "/worlds/", world->world));
        return parts;
    }
    // Not the address of a world: it never runs. But where its repository is blocked, the person is told that
    // first (protocol section 4.1.2: the policy comes before the grammar).
    auto const usual = usual_address(url);
    auto const rest = without_query(std::string_view(usual).substr(std::min(usual.size(), forge.url.size())));
    std::string decoded;
    if (!percent_decode(rest, decoded))
        decoded = rest;
    return parts_of(normal_segments(decoded), forge.kind);
}

/// Forges that are known to take `Owner/Repository` and `owner/repository` for the same.
bool ignores_case(Location const& forge)
{
    constexpr std::array<std::string_view, 5> known{"github.com", "gitlab.com", "bitbucket.org",
                                                    "codeberg.org", "gitee.com"};
    return forge.path.empty() && std::find(known.begin(), known.end(), forge.host) != known.end();
}

std::string_view without_www(std::string_view host)
{
    constexpr std::string_view www = "www.";
    return host.starts_with(www) ? host.substr(www.size()) : host;
}

/// `HEAD`, or a commit by its hash: which branches have it only the forge knows, which was not asked yet.
bool may_be_any_branch(Segments const& ref)
{
    return !ref.empty() && (ref.front() == "HEAD" || git_object_id(ref.front()).has_value());
}

/// Without `refs/heads/` and `refs/tags/`, so often as it is there.
Segments short_ref(Segments ref)
{
    while (ref.size() > 2 && ref[0] == "refs" && (ref[1] == "heads" || ref[1] == "tags"))
        ref.erase(ref.begin(), ref.begin() + 2);
    return ref;
}

/// `rule` and `world`: a ref, and what follows it.
bool blocks_ref(Segments const& rule, Segments const& world)
{
    if (begins_with(world, rule, same_exactly))
        return true;
    auto const brief_rule = short_ref(rule);
    auto const brief_world = short_ref(world);
    if (may_be_any_branch(brief_rule) || may_be_any_branch(brief_world)) {
        auto const both_are_hashes = !brief_rule.empty() && !brief_world.empty() &&
                                     git_object_id(brief_rule.front()) && git_object_id(brief_world.front());
        return !both_are_hashes || begins_with(brief_world, brief_rule, same_without_case);
    }
    return begins_with(brief_world, brief_rule, same_exactly) ||
           begins_with(world, brief_rule, same_exactly) || begins_with(brief_world, rule, same_exactly);
}

Segments from(Segments const& segments, std::size_t first)
{
    return {segments.begin() + static_cast<std::ptrdiff_t>(std::min(first, segments.size())), segments.end()};
}

/// What rules are compared with.
struct World
{
    World(std::string_view url, ForgeOfWorld const& forge)
        : place(location_of(forge.url)), refs(forge.refs), kind(forge.kind), parts(parts_of_world(url, forge))
    {}

    Location place; ///< Of the forge.
    RefMeaning refs;
    ForgeKind kind;
    Parts parts;
};

bool rule_allows(std::string_view rule, World const& world)
{
    auto const named = location_of_rule(rule);
    if (!named)
        return false;
    if (is_scheme_of(*named, world.place))
        return true;
    if (named->scheme != world.place.scheme || named->host != world.place.host)
        return false;
    auto const segments = segments_on_forge(*named, world.place, same_exactly);
    if (!segments)
        return false;
    auto const wanted = parts_of(*segments, world.kind);
    auto const same_name = ignores_case(world.place) ? same_without_case : same_exactly;
    if (!begins_with(world.parts.names, wanted.names, same_name))
        return false;
    if (!wanted.in_view)
        return true;
    return wanted.names.size() == world.parts.names.size() && world.parts.in_view &&
           begins_with(*world.parts.in_view, *wanted.in_view, same_exactly);
}

/// `ref`: what a rule has after the word of a page, such as `tree`.
bool blocks_in_repository(Segments const& ref, World const& world)
{
    if (ref.empty())
        return true;
    auto const found = world.parts.in_view.value_or(Segments());
    switch (world.refs) {
    case RefMeaning::git:
        return blocks_ref(ref, found);
    case RefMeaning::none: // only the folder after it counts
        return begins_with(from(found, 1), from(ref, 1), same_exactly);
    case RefMeaning::unknown:
        break;
    }
    return true;
}

bool rule_blocks(std::string_view rule, World const& world)
{
    auto const named = location_of_rule(rule);
    if (!named)
        return false;
    if (is_scheme_of(*named, world.place))
        return true;
    if (without_www(named->host) != without_www(world.place.host))
        return false;
    auto const segments = segments_on_forge(*named, world.place, same_without_case);
    if (!segments)
        return false;
    auto const& names = world.parts.names;
    auto const common = std::min(segments->size(), names.size());
    auto const wanted = without_dot_gits(
        Segments(segments->begin(), segments->begin() + static_cast<std::ptrdiff_t>(common)));
    if (!begins_with(names, wanted, same_without_case))
        return false;
    // Whatever page of the forge the rule was copied from: /blob/, /tree/, /commits/, /-/tree/, /src/branch/.
    auto const dash = common < segments->size() && (*segments)[common] == "-" ? 1u : 0u;
    auto const ref = from(*segments, common + 1 + dash);
    bool const may_say_kind = !ref.empty() && (ref[0] == "branch" || ref[0] == "tag" || ref[0] == "commit");
    return blocks_in_repository(ref, world) || (may_say_kind && blocks_in_repository(from(ref, 1), world));
}

} // namespace

std::string_view without_dot_git(std::string_view name) noexcept
{
    constexpr std::string_view suffix = ".git";
    if (name.size() > suffix.size() && equal_ignoring_case(name.substr(name.size() - suffix.size()), suffix))
        name.remove_suffix(suffix.size());
    return name;
}

bool allows(std::string_view rule, std::string_view url, ForgeOfWorld const& forge)
{
    return rule_allows(rule, World(url, forge));
}

bool blocks(std::string_view rule, std::string_view url, ForgeOfWorld const& forge)
{
    return rule_blocks(rule, World(url, forge));
}

bool is_on_forge(std::string_view rule, std::string_view forge)
{
    auto const named = location_of_rule(rule);
    auto const place = location_of(forge);
    if (!named)
        return false;
    return is_scheme_of(*named, place) || (without_www(named->host) == without_www(place.host) &&
                                           segments_on_forge(*named, place, same_without_case));
}

std::optional<Failure> refusal(RepositoryPolicy const& policy, std::string_view url,
                               ForgeOfWorld const& forge, double load)
{
    World const world(url, forge);
    auto const& allowed = policy.rules.allowed;
    if (std::any_of(allowed.begin(), allowed.end(),
                    [&](auto const& rule) { return rule_allows(rule, world); }))
        return std::nullopt;
    if (!policy.outside.accepted)
        return policy.outside.needed.empty()
                   ? refused(Refused::outside_allowed)
                   : refused(Refused::outside_sandbox, {{"needed", policy.outside.needed}});
    if (policy.rules.share_idle_time == 0)
        return refused(Refused::not_shared);
    if (load > policy.rules.share_idle_time)
        return refused(Refused::too_busy, {{"load", python_float(load)}});
    auto const& blocked = policy.rules.blocked;
    if (std::any_of(blocked.begin(), blocked.end(),
                    [&](auto const& rule) { return rule_blocks(rule, world); }))
        return refused(Refused::blocked, {{"url", url}});
    return std::nullopt;
}

} // namespace webots_cloud::core
