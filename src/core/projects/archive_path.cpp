#include "archive_path.hpp"

#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {

result<ArchivePath> archive_path(std::string_view name)
{
    constexpr std::size_t longest = 1024;
    constexpr std::size_t deepest = 64;
    auto path = name;
    if (path.ends_with('/'))
        path.remove_suffix(1);
    auto const parts = split(path, '/');
    auto const bad = std::find_if_not(parts.begin(), parts.end(), is_harmless_file_name);
    ArchivePath made;
    made.is_forbidden = bad != parts.end();
    if (made.is_forbidden) {
        auto const end = bad->data() + bad->size();
        made.path = path.substr(0, static_cast<std::size_t>(end - path.data()));
        return made;
    }
    if (path.size() > longest)
        return refused(Refused::path_too_long);
    if (parts.size() > deepest)
        return refused(Refused::folders_too_deep);
    made.path = path;
    return made;
}

} // namespace webots_cloud::core
