// Where a branch ends and the folder begins can't be seen in an address: branch names have slashes. The refs
// of the server decide, and refusals name the part that none of them explains.
#include "git_refs.hpp"

#include "core/text.hpp"
#include "git_problem.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view heads = "refs/heads/";
constexpr std::string_view tags = "refs/tags/";

std::string_view first_segment(std::string_view path) noexcept
{
    return path.substr(0, path.find('/'));
}

/// True when `path` is `prefix` or goes on with a slash after it.
bool begins_with_segments(std::string_view path, std::string_view prefix) noexcept
{
    return path.starts_with(prefix) && (path.size() == prefix.size() || path[prefix.size()] == '/');
}

/// The name as addresses spell it, or empty for refs that addresses can't name.
std::string_view short_name(GitRef const& ref) noexcept
{
    std::string_view const name = ref.name;
    for (auto const space : {heads, tags})
        if (name.starts_with(space))
            return name.substr(space.size());
    return name == "HEAD" ? name : std::string_view();
}

/// How much of `path` names this ref, in short or, as forges do where a branch and a tag have one name, in
/// full; 0: it names another.
std::size_t size_in(std::string_view path, GitRef const& ref) noexcept
{
    auto const brief = short_name(ref);
    if (brief.empty())
        return 0;
    if (begins_with_segments(path, ref.name))
        return ref.name.size();
    return begins_with_segments(path, brief) ? brief.size() : 0;
}

std::size_t count_common_segments(std::string_view path, std::string_view name) noexcept
{
    std::size_t count = 0;
    for (; !path.empty() && !name.empty() && first_segment(path) == first_segment(name); ++count)
        for (auto* const text : {&path, &name})
            text->remove_prefix(std::min(first_segment(*text).size() + 1, text->size()));
    return count;
}

std::string_view first_segments(std::string_view path, std::size_t count) noexcept
{
    std::size_t end = 0;
    for (; count > 0 && end < path.size(); --count)
        end = std::min(path.find('/', end == 0 ? 0 : end + 1), path.size());
    return path.substr(0, end);
}

/// The part of an address that none of the refs explains, without the folder after it: where branches have
/// the names `team/red` and `team/blue`, `team/green` of `team/green/projects`.
std::string_view unknown_ref(std::string_view ref_and_folder, std::vector<GitRef> const& refs) noexcept
{
    for (auto const space : {heads, tags})
        if (ref_and_folder.starts_with(space))
            return ref_and_folder.substr(
                0, space.size() + unknown_ref(ref_and_folder.substr(space.size()), refs).size());
    if (first_segment(ref_and_folder) == "refs")
        return ref_and_folder; // of a kind that is not listed
    std::size_t known = 0;
    for (auto const& ref : refs)
        known = std::max(known, count_common_segments(ref_and_folder, short_name(ref)));
    return first_segments(ref_and_folder, known + 1);
}

GitTarget target(GitObjectId const& commit, std::string_view path, std::size_t ref_size)
{
    GitTarget found;
    found.commit = commit;
    found.folder = path.size() > ref_size ? path.substr(ref_size + 1) : std::string_view();
    return found;
}

} // namespace

result<GitRef> parse_ref_line(std::string_view line)
{
    auto const words = split(line, ' ');
    auto const id = git_object_id(words[0]);
    if (words.size() < 2 || !id || words[1].empty())
        return Failure(GitProblem::malformed, "the git server sent a malformed ref");
    GitRef ref;
    ref.name = words[1];
    ref.id = *id;
    constexpr std::string_view peeled = "peeled:";
    constexpr std::string_view symref = "symref-target:";
    for (auto const word : words) {
        if (word.starts_with(symref))
            ref.target = word.substr(symref.size());
        if (word.starts_with(peeled))
            if (auto const commit = git_object_id(word.substr(peeled.size())))
                ref.id = *commit;
    }
    return ref;
}

std::vector<std::string> ref_prefixes(std::string_view ref_and_folder)
{
    auto const first = first_segment(ref_and_folder);
    std::vector<std::string> prefixes = {concat(heads, first), concat(tags, first)};
    if (first == "HEAD")
        prefixes.insert(prefixes.begin(), std::string(first));
    for (auto const space : {heads, tags})
        if (ref_and_folder.starts_with(space))
            prefixes.push_back(concat(space, first_segment(ref_and_folder.substr(space.size()))));
    return prefixes;
}

std::vector<std::string> all_ref_prefixes()
{
    return {std::string(heads), std::string(tags)};
}

std::string default_branch(std::vector<GitRef> const& refs)
{
    for (auto const& ref : refs)
        if (ref.name == "HEAD" && ref.target.starts_with(heads) && ref.target.size() > heads.size())
            return ref.target.substr(heads.size());
    return "HEAD";
}

bool is_branch_or_tag(std::string_view name) noexcept
{
    return name.starts_with(heads) || name.starts_with(tags);
}

bool names_commit(std::string_view ref_and_folder) noexcept
{
    return git_object_id(first_segment(ref_and_folder)).has_value();
}

result<GitTarget> resolve_ref(std::string_view ref_and_folder, std::vector<GitRef> const& refs)
{
    auto const first = first_segment(ref_and_folder);
    if (auto const commit = git_object_id(first))
        return target(*commit, ref_and_folder, first.size());
    GitRef const* best = nullptr;
    std::size_t longest = 0;
    // The longest name explains most of the address. Of a branch and a tag with one name, the branch counts.
    for (auto const& ref : refs) {
        auto const size = size_in(ref_and_folder, ref);
        if (size > longest || (size > 0 && size == longest && ref.name.starts_with(heads))) {
            best = &ref;
            longest = size;
        }
    }
    if (!best)
        return Failure(GitProblem::no_such_ref, printable(unknown_ref(ref_and_folder, refs), 100));
    return target(best->id, ref_and_folder, longest);
}

} // namespace webots_cloud::core
