// What a project says in `webots.yml` that a machine must have to run it.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// How many labels a project may name.
inline constexpr std::size_t max_needed_labels = 8;

struct ProjectNeeds
{
    ProjectNeeds() = default;

    std::vector<std::string> labels; ///< Of its lines `labels:`, each once.
    bool containers = false; ///< It has a line `dockerCompose:`, which means nothing to native programs.

    /// All that a machine must have where somebody can choose another machine.
    std::vector<std::string> all() const;
};

/// Reads `webots.yml` line by line, as `parse_webots_yml` does; it need not be valid YAML.
///
/// Errors: `invalid_argument`: a line `labels:` has other words than labels, or too many.
result<ProjectNeeds> project_needs(std::string_view webots_yml);

/// Those of `needed` that are not among `labels`.
std::vector<std::string> lacking(std::vector<std::string> const& needed,
                                 std::vector<std::string> const& labels);

/// Why a machine that lacks labels refuses a project; `missing` is not empty.
Failure lacks_labels(std::vector<std::string> const& missing);

} // namespace webots_cloud::core
