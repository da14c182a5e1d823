#include "archive_path.hpp"

#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {

result<std::string> archive_path(std::string_view name)
{
    constexpr std::size_t longest = 1024;
    constexpr std::size_t deepest = 64;
    auto path = name;
    if (path.ends_with('/'))
        path.remove_suffix(1);
    if (path.size() > longest)
        return refused(Refused::path_too_long);
    auto const parts = split(path, '/');
    if (parts.size() > deepest)
        return refused(Refused::folders_too_deep);
    if (!std::all_of(parts.begin(), parts.end(), is_harmless_file_name))
        return refused(Refused::forbidden_name, {{"name", printable(name, 100)}});
    return std::string(path);
}

} // namespace webots_cloud::core
