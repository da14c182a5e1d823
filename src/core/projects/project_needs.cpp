#include "project_needs.hpp"

#include "core/machine_labels.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view containers_label = "docker";

bool has(std::vector<std::string> const& labels, std::string_view label)
{
    return std::ranges::find(labels, label) != labels.end();
}

Failure wrong_line(std::string_view line)
{
    return refused(Refused::wrong_labels_line,
                   {{"line", printable(trim(line), 100)}, {"max", std::to_string(max_needed_labels)}});
}

} // namespace

std::vector<std::string> ProjectNeeds::all() const
{
    auto needed = labels;
    if (containers && !has(needed, containers_label))
        needed.emplace_back(containers_label);
    return needed;
}

result<ProjectNeeds> project_needs(std::string_view webots_yml)
{
    constexpr std::string_view labels_key = "labels:";
    ProjectNeeds needs;
    for (auto const line : split(webots_yml, '\n')) {
        if (line.starts_with("dockerCompose:"))
            needs.containers = true;
        if (!line.starts_with(labels_key))
            continue;
        for (auto const word : split(trim(line.substr(labels_key.size())), ' ')) {
            if (word.empty() || has(needs.labels, word))
                continue;
            if (!is_label(word) || needs.labels.size() == max_needed_labels)
                return wrong_line(line);
            needs.labels.emplace_back(word);
        }
    }
    return needs;
}

std::vector<std::string> lacking(std::vector<std::string> const& needed,
                                 std::vector<std::string> const& labels)
{
    std::vector<std::string> missing;
    std::ranges::copy_if(needed, std::back_inserter(missing),
                         [&](std::string const& label) { return !has(labels, label); });
    return missing;
}

Failure lacks_labels(std::vector<std::string> const& missing)
{
    return refused(Refused::lacks_labels, {{"labels", join({missing.begin(), missing.end()}, ", ")}});
}

} // namespace webots_cloud::core
