// Which commit and which folder a world's address means.
#pragma once

#include "git_object_id.hpp"

#include <webots_cloud/error.hpp>

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// A ref as a server lists it.
struct GitRef
{
    std::string name;     ///< `refs/heads/main`
    GitObjectId id;       ///< For an annotated tag what it points to.
    std::string target{}; ///< Of `HEAD`, the name of the default branch; empty: the server has not said it.
};

/// One line of an `ls-refs` answer: `<id> <name>[ symref-target:<name>][ peeled:<id>]`.
///
/// Errors: `malformed`.
result<GitRef> parse_ref_line(std::string_view line);

/// A commit and a folder in it (empty: the whole tree).
struct GitTarget
{
    GitObjectId commit;
    std::string folder;

    bool operator==(GitTarget const&) const = default;
};

/// What `ref-prefix` arguments list every ref that `ref_and_folder` may begin with.
std::vector<std::string> ref_prefixes(std::string_view ref_and_folder);

/// What `ref-prefix` arguments list all branches and tags.
std::vector<std::string> all_ref_prefixes();

/// The branch that `HEAD` stands for, as addresses name it; `HEAD` where that is not known.
std::string default_branch(std::vector<GitRef> const& refs);

/// True for the name of a branch or a tag: forges have refs of other kinds, which anybody may create.
bool is_branch_or_tag(std::string_view name) noexcept;

/// True when `ref_and_folder` begins with a commit (40 hexadecimal digits).
bool names_commit(std::string_view ref_and_folder) noexcept;

/// Splits `<ref>[/<folder>]`: the longest ref that is listed wins, branches before tags; 40 digits are a
/// commit.
///
/// Errors: `no_such_ref`.
result<GitTarget> resolve_ref(std::string_view ref_and_folder, std::vector<GitRef> const& refs);

} // namespace webots_cloud::core
