#include "class_paths.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

std::string class_file(std::string_view path)
{
    constexpr std::string_view folder = "/class/";
    if (!path.starts_with(folder))
        return {};
    auto const name = path.substr(folder.size());
    // The page finds the viewer's files below itself, so that proxies need one rule for both.
    if (name.starts_with("view/"))
        return std::string(name);
    if (name == "base.css" || name == "page.css" || name == "favicon.svg")
        return concat("viewer/", name);
    if (name.find_first_of("./") == std::string_view::npos)
        return "class/index.html";
    return concat("class/", name);
}

std::string_view class_token(std::string_view query) noexcept
{
    constexpr std::string_view key = "class=";
    while (!query.empty()) {
        auto const part = query.substr(0, query.find('&'));
        if (part.starts_with(key))
            return part.substr(key.size());
        query.remove_prefix(part.size() == query.size() ? part.size() : part.size() + 1);
    }
    return {};
}

} // namespace webots_cloud::core
