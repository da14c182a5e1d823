#include "core/machine_labels.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {

namespace {

constexpr std::size_t max_length = 40;

bool is_letter_or_digit(char c) noexcept
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

void add(std::vector<std::string>& labels, std::string label)
{
    if (!label.empty() && labels.size() < max_labels && std::ranges::find(labels, label) == labels.end())
        labels.push_back(std::move(label));
}

} // namespace

bool is_label(std::string_view text) noexcept
{
    static constexpr std::string_view marks = "._-+";
    return !text.empty() && text.size() <= max_length && std::ranges::all_of(text, [](char c) {
        return is_letter_or_digit(c) || marks.find(c) != std::string_view::npos;
    });
}

std::string webots_release(std::string_view version_text)
{
    auto const first = trim(version_text.substr(0, version_text.find('\n')));
    bool const is_release =
        first.size() > 1 && first[0] == 'R' && first[1] >= '0' && first[1] <= '9' && is_label(first);
    return is_release ? std::string(first) : std::string();
}

std::vector<std::string> machine_labels(std::vector<std::string> configured, bool docker,
                                        std::string_view version_text)
{
    std::vector<std::string> labels = std::move(configured);
    add(labels, docker ? "docker" : webots_release(version_text));
    return labels;
}

} // namespace webots_cloud::core
