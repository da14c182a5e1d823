#include "git_proof.hpp"

#include "adapters/git_packs/git_digest.hpp"

#include "core/git/git_layout.hpp"
#include "core/git/git_tree.hpp"
#include "core/text.hpp"

#include <charconv>
#include <optional>
#include <unordered_map>

namespace webots_cloud::adapters {
namespace {

using core::concat;

using Objects = std::unordered_map<core::GitObjectId, std::string, core::GitObjectIdHash>;

/// One record: a letter, a size, and that many bytes.
struct Record
{
    char kind = 0;
    std::string_view bytes;
};

std::optional<Record> take_record(std::string_view& text)
{
    auto const line_end = text.find('\n');
    if (line_end == std::string_view::npos || line_end < 3 || text[1] != ' ')
        return std::nullopt;
    std::size_t size = 0;
    auto const [end, failed] = std::from_chars(text.data() + 2, text.data() + line_end, size);
    if (failed != std::errc() || end != text.data() + line_end || size > text.size() - line_end - 1)
        return std::nullopt;
    Record const record{text[0], text.substr(line_end + 1, size)};
    text.remove_prefix(line_end + 1 + size);
    return record;
}

core::GitObjectId id_of(std::string_view kind, std::string_view object)
{
    auto const header = concat(kind, " ", std::to_string(object.size()));
    GitDigest digest;
    digest.update({header.c_str(), header.size() + 1}); // with the zero
    digest.update(object);
    return digest.finish();
}

/// Whether the entries are the items, but for what may be left out.
bool agree(std::vector<core::GitLayoutItem> const& layout, std::vector<GitIndexEntry> const& entries)
{
    auto entry = entries.begin();
    bool has_parent_files = false;
    bool lacks_parent_files = false;
    for (auto const& item : layout) {
        auto const is_link = item.kind == core::GitTreeEntry::Kind::link;
        if (entry != entries.end() && entry->path == item.path) {
            if (entry->kind != item.kind || entry->id != item.id)
                return false;
            ++entry;
            has_parent_files = has_parent_files || item.of_parent;
        } else if (item.of_parent) {
            lacks_parent_files = lacks_parent_files || !is_link;
        } else if (!is_link) {
            return false;
        }
    }
    // The files of the folders above are all there, or none is; links may be missing anyway.
    return entry == entries.end() && !(has_parent_files && lacks_parent_files);
}

} // namespace

GitProof::GitProof(std::string_view folder)
{
    add('f', folder);
}

void GitProof::add(char kind, std::string_view object)
{
    text_ += kind;
    text_.append(concat(" ", std::to_string(object.size()), "\n")).append(object);
}

void GitProof::add_tree(core::GitObjectId const& id, std::string_view object)
{
    if (trees_.insert(id).second)
        add('t', object);
}

std::string proven_folder(std::string_view proof)
{
    auto const first = take_record(proof);
    return first && first->kind == 'f' ? std::string(first->bytes) : std::string();
}

bool is_proven(std::string_view proof, core::GitObjectId const& commit, GitIndex const& index)
{
    auto const folder = proven_folder(proof);
    Objects trees;
    std::optional<core::GitObjectId> root;
    // Each object is known by the digest that we compute ourselves: what is forged leads nowhere.
    for (auto record = take_record(proof); record; record = take_record(proof)) {
        if (record->kind == 't')
            trees.emplace(id_of("tree", record->bytes), record->bytes);
        if (record->kind == 'c' && id_of("commit", record->bytes) == commit)
            if (auto const tree = core::tree_of_commit(record->bytes))
                root = *tree;
    }
    if (!root || !proof.empty())
        return false;
    auto const lookup = [&trees](core::GitObjectId const& id) -> std::string const* {
        auto const found = trees.find(id);
        return found == trees.end() ? nullptr : &found->second;
    };
    core::GitLayoutLimits limits; // larger than the index, by what was left out
    limits.items = static_cast<std::uint32_t>(2 * index.entries.size() + core::GitLayoutLimits().items);
    // The same steps as after the download, so that they come to the same layout.
    auto way = core::find_git_folder(*root, folder, limits, lookup);
    auto const layout = way ? core::lay_out_git_folder(*way, limits, lookup)
                            : result<std::vector<core::GitLayoutItem>>(way.error());
    return layout && agree(*layout, index.entries);
}

} // namespace webots_cloud::adapters
