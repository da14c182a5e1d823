#include "archive_path.hpp"

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
        return Failure(errc::too_large, "The project has a file whose path is too long.");
    auto const parts = split(path, '/');
    if (parts.size() > deepest)
        return Failure(errc::too_large, "The project has folders that are nested too deeply.");
    if (!std::all_of(parts.begin(), parts.end(), is_safe_file_name))
        return Failure(errc::protocol_error, concat("The project has a file with a forbidden name: \"",
                                                    printable(name, 100), "\"."));
    return std::string(path);
}

} // namespace webots_cloud::core
