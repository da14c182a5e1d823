// What becomes files: folders of a stranger's repository, and the index that the cache keeps of them.
// Whatever they hold, every path stays inside and every limit holds.
#include "fuzz.hpp"

#include "adapters/git_packs/git_index.hpp"
#include "core/git/git_layout.hpp"
#include "core/git/git_worlds.hpp"
#include "core/safe_names.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>

using namespace webots_cloud;
using Kind = core::GitTreeEntry::Kind;

namespace {

core::GitObjectId id(unsigned number)
{
    core::GitObjectId made;
    made.bytes[0] = static_cast<std::uint8_t>(number);
    return made;
}

/// Folders by number, which may hold each other in circles: `<entries>`, and for each of them
/// `<mode> <length of the name> <name> <what it is>`.
std::map<core::GitObjectId, std::string> cook(std::string_view recipe)
{
    constexpr unsigned max_trees = 8;
    constexpr std::string_view modes[] = {"40000", "100644", "100755", "120000", "160000", "40000"};
    std::map<core::GitObjectId, std::string> trees;
    for (unsigned number = 0; number < max_trees; ++number) {
        auto& tree = trees[id(number)];
        for (auto entries = fuzz::take_byte(recipe) % 8; entries > 0; --entries) {
            tree.append(modes[fuzz::take_byte(recipe) % std::size(modes)]).append(" ");
            tree.append(fuzz::take(recipe, fuzz::take_byte(recipe) % 16)).append(1, '\0');
            auto const target = id(fuzz::take_byte(recipe) % (max_trees + 1)); // the last one is missing
            tree.append(target.bytes.begin(), target.bytes.end());
        }
    }
    return trees;
}

void check(std::vector<core::GitLayoutItem> const& items, core::GitLayoutLimits const& limits,
           std::size_t folder_depth)
{
    std::set<std::string> folders{""};
    std::set<std::string> paths;
    fuzz::require(items.size() <= limits.items + folder_depth);
    for (auto const& item : items) {
        fuzz::require(fuzz::stays_inside(item.path) && item.path.size() <= limits.path_length);
        fuzz::require(item.kind != Kind::submodule && item.depth() <= limits.depth + folder_depth);
        fuzz::require(paths.insert(item.path).second);
        auto const slash = item.path.rfind('/');
        auto const inside = slash == std::string::npos ? std::string() : item.path.substr(0, slash);
        fuzz::require(folders.count(inside) > 0);
        fuzz::require(core::is_harmless_file_name(std::string_view(item.path).substr(slash + 1)));
        if (item.kind == Kind::folder)
            folders.insert(item.path);
    }
}

void layout(std::string_view recipe)
{
    core::GitLayoutLimits limits;
    limits.items = fuzz::take_byte(recipe);
    limits.path_length = 40;
    limits.depth = 6;
    limits.parent_files = 5;
    auto const path = fuzz::take(recipe, fuzz::take_byte(recipe) % 8);
    auto const trees = cook(recipe);
    std::size_t asked = 0;
    auto const lookup = [&](core::GitObjectId const& wanted) {
        ++asked;
        auto const found = trees.find(wanted);
        return found == trees.end() ? nullptr : &found->second;
    };
    core::GitWorldLimits of_worlds;
    of_worlds.entries = limits.items;
    of_worlds.depth = limits.depth;
    for (std::string_view const folder : {std::string_view(), path}) {
        asked = 0;
        if (auto const worlds = core::find_git_worlds(id(0), folder, of_worlds, lookup)) {
            fuzz::require(asked <= limits.items + 2 + folder.size());
            for (auto const& world : *worlds)
                fuzz::require(fuzz::stays_inside(world.path) && world.path.ends_with(".wbt"));
        }
        auto way = core::find_git_folder(id(0), folder, limits, lookup);
        if (!way)
            continue;
        auto const depth = way->path.empty() ? 0 : 1 + std::count(way->path.begin(), way->path.end(), '/');
        asked = 0;
        auto const items = core::lay_out_git_folder(*way, limits, lookup);
        fuzz::require(asked <= limits.items + 1);
        fuzz::require(way->forbidden.size() <= core::max_forbidden);
        if (items)
            check(*items, limits, static_cast<std::size_t>(depth));
    }
}

void read_index(std::string_view text)
{
    auto const index = adapters::parse_index(text);
    if (!index)
        return;
    for (auto const& entry : index->entries)
        fuzz::require(fuzz::stays_inside(entry.path) && entry.kind != Kind::submodule);
    auto const written = adapters::write_index(*index);
    auto const again = adapters::parse_index(written);
    fuzz::require(again && again->bytes == index->bytes && adapters::write_index(*again) == written);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    layout(text);
    read_index(text);
    return 0;
}
