// One download, step by step: room is reserved before anything is made, and given back however it ends. The
// layout is decided by core/git/git_layout; git_unpack.cpp writes it; git_cache.cpp keeps the result.
#include "git_download.hpp"

#include "adapters/files/project_files.hpp"

#include "core/git/git_history.hpp"
#include "core/git/git_tree.hpp"
#include "core/projects/world_info.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"

#include <fcntl.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <unordered_set>

namespace webots_cloud::adapters {
namespace {

using core::concat;
using core::GitProblem;
using Kind = core::GitTreeEntry::Kind;

// Of memory, in bytes, about: what is not counted object by object.
// Buffers on the way, and one file of a megabyte.
constexpr std::uint64_t memory_of_download = std::uint64_t{4} << 20;
constexpr std::uint64_t memory_of_layout = std::uint64_t{96} << 20; // of 50,000 files with the longest paths
constexpr std::uint64_t max_memory_of_entries = std::uint64_t{48} << 20; // of one folder: 100,000
constexpr std::uint64_t memory_of_item = 512; // layout, index, its text; the path comes 4 times
constexpr std::uint64_t max_memory_of_item = memory_of_item + 4 * 1024;

bool is_file(Kind kind) noexcept
{
    return kind == Kind::file || kind == Kind::executable;
}

GitDonors donors_among(std::vector<GitSnapshotPtr> const& relatives, std::vector<FileDescriptor>& folders)
{
    GitDonors donors;
    for (auto const& relative : relatives) {
        auto folder = open_folder(AT_FDCWD, relative->files.c_str());
        if (!folder)
            continue;
        for (auto const& entry : relative->index.entries) {
            if (!is_file(entry.kind))
                continue;
            GitDonors::File file;
            file.folder = folder->get();
            file.path = entry.path;
            file.kind = entry.kind;
            file.size = entry.size;
            file.pointer = entry.pointer;
            donors.files.emplace(entry.id, std::move(file));
        }
        folders.push_back(std::move(*folder));
    }
    return donors;
}

std::uint64_t memory_of_items(std::vector<core::GitLayoutItem> const& layout)
{
    constexpr std::uint64_t copies = 4;
    std::uint64_t bytes = 0;
    for (auto const& item : layout)
        bytes += memory_of_item + copies * item.path.size();
    return bytes;
}

std::uint64_t memory_of_files(GitDonors const& donors)
{
    constexpr std::uint64_t each = 224; // bytes: an entry of the map, and its file
    std::uint64_t bytes = 0;
    for (auto const& [id, file] : donors.files)
        bytes += each + file.path.size() + file.pointer.size();
    return bytes;
}

} // namespace

GitDownload::GitDownload(GitCache& cache, FetchShare& share, GitDownloadOrder order)
    : cache_(cache), share_(share), order_(std::move(order)), loan_(share_)
{}

result<> GitDownload::take_memory(std::uint64_t bytes)
{
    FetchBytes price;
    price.memory = bytes;
    return share_.take(price);
}

result<> GitDownload::begin()
{
    if (auto const taken = take_memory(memory_of_download); !taken)
        return taken.error();
    auto incoming = cache_.begin();
    if (!incoming)
        return incoming.error();
    incoming_.emplace(std::move(*incoming));
    auto objects = make_folder(AT_FDCWD, (incoming_->folder() / "objects").c_str());
    if (!objects)
        return objects.error();
    objects_ = std::move(*objects);
    staging_.emplace(objects_.get(), &share_);
    relatives_ = cache_.relatives(order_.project.clone_url());
    donors_ = donors_among(relatives_, donor_folders_);
    if (!take_memory(memory_of_files(donors_)))
        donors_.files.clear(); // it goes without them, too
    return {};
}

// ---- what there is, and what becomes of it -------------------------------------------------------------

result<> GitDownload::lay_out(core::GitTarget const& target)
{
    folder_ = target.folder;
    proof_.emplace(target.folder);
    auto way = find_folder(target);
    if (!way)
        return way.error();
    auto layout = lay_out_folder(*way);
    if (!layout)
        return layout.error();
    layout_ = std::move(*layout);
    left_out_ = way->left_out;
    forbidden_ = std::move(way->forbidden);
    parents_.emplace(layout_, *staging_, donors_);
    watching_.emplace(*staging_, *parents_);
    return {};
}

result<> GitDownload::find_worlds(core::GitTarget const& target)
{
    FetchShare::Loan const loan(share_); // for the entries of one folder after the other
    proof_.emplace(target.folder);
    result<> paid;
    std::uint64_t taken = 0;
    auto const lookup = [&](core::GitObjectId const& id) -> std::string const* {
        auto const* const folder = ask(order_.interrupt) ? staging_->find(id) : nullptr;
        if (folder && paid)
            paid = pay_for_entries(*folder, taken);
        return paid ? folder : nullptr;
    };
    auto const root = root_of(target.commit);
    if (!root)
        return root.error();
    auto worlds = core::find_git_worlds(*root, target.folder, core::GitWorldLimits(), lookup);
    if (auto const going_on = ask(order_.interrupt); !going_on)
        return going_on.error();
    if (!paid)
        return paid.error();
    if (!worlds)
        return worlds.error();
    worlds_ = std::move(*worlds);
    return {};
}

std::vector<core::GitObjectId> GitDownload::missing_worlds() const
{
    constexpr std::size_t read_worlds = 100; // more are listed without title and text
    std::vector<core::GitObjectId> missing;
    std::unordered_set<core::GitObjectId, core::GitObjectIdHash> seen;
    for (auto const& world : worlds_)
        if (missing.size() < read_worlds && !staging_->has_blob(world.id) && seen.insert(world.id).second)
            missing.push_back(world.id);
    return missing;
}

std::vector<ListedWorld> GitDownload::read_worlds(std::string const& base) const
{
    std::vector<ListedWorld> listed;
    for (auto const& world : worlds_) {
        auto& each = listed.emplace_back(base);
        for (auto const part : core::split(world.path, '/'))
            each.url += concat("/", core::percent_encode(part));
        auto const text =
            staging_->has_blob(world.id) ? staging_->read_blob(world.id) : result<std::string>("");
        auto info = core::world_info(text ? std::string_view(*text).substr(0, core::world_info_bytes) : "");
        each.title = std::move(info.title);
        each.text = std::move(info.text);
    }
    return listed;
}

result<core::GitObjectId> GitDownload::root_of(core::GitObjectId const& id)
{
    auto const* const commit = staging_->find(id);
    if (!commit && !staging_->has_blob(id))
        return Failure(GitProblem::object_missing, "the git server left out the commit");
    auto const root = commit ? core::tree_of_commit(*commit) : result<core::GitObjectId>(Failure());
    if (!root)
        return Failure(GitProblem::not_a_commit, core::printable(order_.project.ref_and_folder, 100));
    proof_->add_commit(*commit);
    return root;
}

/// The way to the wanted folder, which must have a folder `worlds`.
result<core::GitWay> GitDownload::find_folder(core::GitTarget const& target)
{
    FetchShare::Loan const loan(share_); // for the entries of one folder after the other
    result<> paid;
    std::uint64_t taken = 0;
    // It can only say that a folder is missing: whether that was for want of memory, `paid` knows.
    auto const lookup = [&](core::GitObjectId const& id) -> std::string const* {
        auto const* const folder = staging_->find(id);
        if (folder && paid)
            paid = pay_for_entries(*folder, taken);
        if (!folder || !paid)
            return nullptr;
        proof_->add_tree(id, *folder);
        return folder;
    };
    auto const root = root_of(target.commit);
    if (!root)
        return root.error();
    auto way = core::find_git_folder(*root, target.folder, core::GitLayoutLimits(), lookup);
    auto const* const folder = way ? lookup(way->tree) : nullptr;
    // Without memory a folder only seems to be missing: that is said first.
    if (!paid)
        return paid.error();
    if (!way)
        return way.error();
    auto const entries = core::parse_git_tree(folder ? std::string_view(*folder) : std::string_view());
    if (!entries)
        return entries.error();
    if (std::none_of(entries->begin(), entries->end(),
                     [](auto const& entry) { return entry.name == "worlds"; }))
        return Failure(GitProblem::no_such_folder,
                       target.folder.empty() ? "worlds"
                                             : concat(core::printable(target.folder, 200), "/worlds"));
    return way;
}

result<GitDownload::Layout> GitDownload::lay_out_folder(core::GitWay& way)
{
    core::GitLayoutLimits limits;
    limits.items = order_.limits.files;
    result<> paid;
    std::uint64_t taken = 0;
    auto const lookup = [&](core::GitObjectId const& id) -> std::string const* {
        auto const* const folder = ask(order_.interrupt) ? staging_->find(id) : nullptr;
        if (folder && paid)
            paid = pay_for_folder(*folder, taken);
        // The proof keeps each folder once, however many paths lead to it.
        if (folder && paid && !proof_->has_tree(id))
            paid = take_memory(folder->size());
        if (!folder || !paid)
            return nullptr;
        proof_->add_tree(id, *folder);
        return folder;
    };
    auto layout = core::lay_out_git_folder(way, limits, lookup);
    if (auto const going_on = ask(order_.interrupt); !going_on)
        return going_on.error();
    if (!paid)
        return paid.error();
    if (!layout)
        return layout.error();
    // What the layout might have become was paid for; now it is known what it is.
    FetchBytes spare;
    spare.memory = taken - std::min(taken, memory_of_items(*layout));
    share_.give_back(spare);
    return layout;
}

/// For what a folder becomes in a layout, whatever the path to it: before it is looked into. `taken`: for the
/// layout so far.
result<> GitDownload::pay_for_folder(std::string const& folder, std::uint64_t& taken)
{
    constexpr std::uint64_t min_entry_size = 27; // mode, blank, zero and digest, without a name
    auto const wanted = (folder.size() / min_entry_size + 1) * max_memory_of_item;
    auto const more = std::min(wanted, memory_of_layout - taken);
    auto paid = take_memory(more);
    if (paid)
        taken += more;
    return paid;
}

/// For the entries of a folder that is looked into on the way; `taken`: for the largest so far.
result<> GitDownload::pay_for_entries(std::string const& folder, std::uint64_t& taken)
{
    constexpr std::uint64_t growth = 4; // from the text of a tree to its entries
    auto const wanted = std::min(growth * folder.size(), max_memory_of_entries);
    if (wanted <= taken)
        return {};
    auto paid = take_memory(wanted - taken);
    if (paid)
        taken = wanted;
    return paid;
}

std::vector<core::GitObjectId> GitDownload::missing(core::GitFiles files) const
{
    return missing_files(layout_, *staging_, donors_, files != core::GitFiles::of_project);
}

void GitDownload::expect(core::GitFiles files)
{
    if (files == core::GitFiles::of_project)
        parents_->ignore();
    else if (files == core::GitFiles::all_after_project)
        parents_->expect(layout_, *staging_, donors_);
}

result<bool> GitDownload::is_in_history(core::GitObjectId const& commit,
                                        std::vector<core::GitObjectId> const& tips)
{
    FetchShare::Loan const loan(share_);
    constexpr std::uint64_t growth = 3; // of a line that names a parent: seen, and waiting to be looked at
    if (auto const taken = take_memory(growth * staging_->memory()); !taken)
        return taken.error();
    auto const lookup = [&](core::GitObjectId const& id) {
        return ask(order_.interrupt) ? staging_->find(id) : nullptr;
    };
    auto const found = core::is_in_git_history(commit, tips, lookup);
    if (auto const going_on = ask(order_.interrupt); !going_on)
        return going_on.error();
    return found;
}

// ---- the folder ----------------------------------------------------------------------------------------

result<> GitDownload::unpack()
{
    watching_.reset();
    leave_out_large_parents();
    auto files = make_folder(AT_FDCWD, (incoming_->folder() / "files").c_str());
    if (!files)
        return files.error();
    files_ = std::move(*files);
    if (auto const paid = pay_for_files(); !paid)
        return paid.error();
    auto index = unpack_git_folder(layout_, *staging_, donors_, files_.get(), order_.interrupt);
    if (!index)
        return index.error();
    index_ = std::move(*index);
    index_.forbidden = std::move(forbidden_);
    return {};
}

/// The log says so once, when the project is fetched.
void GitDownload::leave_out_large_parents()
{
    if (!may_keep_parent_files(layout_, *staging_, donors_, order_.limits.bytes))
        left_out_ = leave_out_parent_files(layout_) || left_out_;
    if (!left_out_)
        return;
    auto const& project = order_.project;
    cache_.note(concat("The project in ", core::printable(folder_, 200), " of ", project.owner, "/",
                       project.repository,
                       " lacks the files of the folders above it, which are too large or ",
                       "too many (more than ", std::to_string(max_parent_bytes >> 20), " MB or ",
                       std::to_string(core::GitLayoutLimits().parent_files), ")."));
}

/// Before anything is made of the layout: a file that occurs many times may have to be copied each time.
result<> GitDownload::pay_for_files()
{
    std::unordered_set<core::GitObjectId, core::GitObjectIdHash> moved;
    std::uint64_t bytes = 0;
    FetchBytes price;
    for (auto const& item : layout_) {
        auto const donor = is_file(item.kind) ? donors_.files.find(item.id) : donors_.files.end();
        auto const is_here =
            is_file(item.kind) && donor == donors_.files.end() && staging_->has_blob(item.id);
        std::uint64_t size = 0; // links have a kilobyte at most
        if (is_here)
            size = staging_->blob_size(item.id);
        else if (donor != donors_.files.end())
            size = donor->second.size;
        bytes += size;
        if (!is_here || !moved.insert(item.id).second)
            price.disk += bytes_on_disk(size);
        if (bytes > order_.limits.bytes)
            return core::refused(core::Refused::project_too_large,
                                 {{"max", std::to_string(order_.limits.bytes >> 20)}});
    }
    return share_.take(price);
}

result<GitSnapshotPtr> GitDownload::publish(std::string const& url, core::GitTarget const& target)
{
    std::error_code ignored;
    std::filesystem::remove_all(incoming_->folder() / "objects", ignored);
    return cache_.publish(*incoming_, url, target, std::move(index_), proof_->text());
}

} // namespace webots_cloud::adapters
