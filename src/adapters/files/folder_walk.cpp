#include "folder_walk.hpp"

namespace webots_cloud::adapters {

result<int> FolderWalk::parent_of(std::string_view path)
{
    while (!levels_.empty() && !path.starts_with(levels_.back().path))
        levels_.pop_back();
    for (;;) {
        auto const begin = levels_.empty() ? 0 : levels_.back().path.size();
        auto const parent = levels_.empty() ? root_ : levels_.back().folder.get();
        auto const slash = path.find('/', begin);
        if (slash == std::string_view::npos)
            return parent;
        auto const name = std::string(path.substr(begin, slash - begin));
        auto folder = open_folder(parent, name.c_str());
        if (!folder)
            return folder.error();
        levels_.push_back(Level{std::string(path.substr(0, slash + 1)), std::move(*folder)});
    }
}

} // namespace webots_cloud::adapters
