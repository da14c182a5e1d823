// Fetched folders, kept by what they are (commit and folder), so that a start whose ref still means the same
// commit costs a checkout alone. What is on disk may be damaged or half gone at any time: each entry has an
// index and is checked against it before it is used. The oldest go when there are too many bytes.
#include "git_cache.hpp"

#include "adapters/files/own_folder.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/git_packs/git_digest.hpp"
#include "git_proof.hpp"

#include "core/projects/repository_policy.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/adapters/secrets.hpp>
#include <webots_cloud/load_report.hpp>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <utility>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr std::uint64_t max_index_size = std::uint64_t{128} << 20;
constexpr std::uint64_t max_proof_size = std::uint64_t{288} << 20; // more than `GitStaging` keeps
constexpr int max_siblings = 16;                                   // servers that are given the same folder
constexpr std::size_t max_notices = 16;                            // not taken yet

std::string digest_of(std::string_view text)
{
    GitDigest digest;
    digest.update(text);
    return to_hex(digest.finish());
}

std::string snapshot_name(core::GitTarget const& target)
{
    return concat(to_hex(target.commit), "-", digest_of(target.folder).substr(0, 16));
}

/// Folders and the rest of a file's last block take room too.
std::uint64_t bytes_of(GitIndex const& index)
{
    constexpr std::uint64_t each = 4096;
    return index.bytes + each * index.entries.size();
}

std::uint64_t memory_of(GitIndex const& index)
{
    constexpr std::uint64_t allocation = 16; // what surrounds a path
    std::uint64_t bytes = 0;
    for (auto const& entry : index.entries)
        bytes += sizeof entry + 2 * allocation + entry.path.size() + entry.pointer.size();
    return bytes;
}

std::optional<core::GitObjectId> commit_of(fs::path const& folder)
{
    return core::git_object_id(folder.filename().string().substr(0, 40));
}

/// What the name of a stored folder and its proof say that it is; nothing where its index is of something
/// else.
std::optional<core::GitTarget> proven_target(fs::path const& folder, GitIndex const& index)
{
    auto const proof = read_file(AT_FDCWD, (folder / "proof").c_str(), max_proof_size);
    auto const commit = commit_of(folder);
    if (!proof || !commit)
        return std::nullopt;
    core::GitTarget target;
    target.commit = *commit;
    target.folder = proven_folder(*proof);
    if (snapshot_name(target) != folder.filename() || !is_proven(*proof, *commit, index))
        return std::nullopt;
    return target;
}

constexpr std::uint64_t max_ref_size = 4096; // a commit, a path and a number

/// What a ref meant last, and the key of that project.
struct RefMeant
{
    core::GitTarget target;
    std::uint32_t project = 0;
};

std::string write_ref(core::GitTarget const& target, std::uint32_t project)
{
    return concat(to_hex(target.commit), " ", target.folder, "\n", std::to_string(project), "\n");
}

std::optional<RefMeant> parse_ref(std::string_view text)
{
    auto const line = text.substr(0, text.find('\n'));
    if (line.size() < 41 || line.size() == text.size())
        return std::nullopt;
    auto const commit = core::git_object_id(line.substr(0, 40));
    if (!commit)
        return std::nullopt;
    RefMeant meant;
    meant.target.commit = *commit;
    meant.target.folder = line.substr(41);
    auto const rest = text.substr(line.size() + 1);
    auto const [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), meant.project);
    if (error != std::errc() || std::string_view(end, rest.data() + rest.size()) != "\n")
        return std::nullopt;
    return meant;
}

/// A link to one is none: what it leads to is not ours to clear away.
bool is_folder(fs::directory_entry const& entry)
{
    std::error_code failed;
    return entry.symlink_status(failed).type() == fs::file_type::directory;
}

} // namespace

std::uint32_t project_key_of(std::string const& clone_url, std::string const& ref_and_folder)
{
    return project_key(core::without_dot_git(clone_url), ref_and_folder);
}

GitIncoming::~GitIncoming()
{
    if (!folder_.empty())
        remove_tree(folder_);
}

GitCache::GitCache(fs::path folder, GitSourceConfig config, std::shared_ptr<FetchBudget> budget)
    : config_(std::move(config)), budget_(std::move(budget))
{
    open(folder);
    if (!usable_)
        return;
    scan();
    trim();
    list_projects();
}

GitCache::~GitCache() = default;

void GitCache::open(fs::path const& folder)
{
    // A cache belongs to one server, which keeps its lock: the next one takes `<folder>-1`, and so on.
    for (int sibling = 0; sibling < max_siblings; ++sibling) {
        folder_ = sibling == 0 ? folder : fs::path(concat(folder.string(), "-", std::to_string(sibling)));
        if (folder.empty() || !make_folders()) {
            usable_ = Failure(errc::unavailable, concat("the cache folder \"", folder_.string(),
                                                        "\" can't be made or belongs to somebody else"));
            return;
        }
        if (::flock(lock_.get(), LOCK_EX | LOCK_NB) == 0)
            return;
    }
    usable_ = Failure(errc::unavailable, concat("cache folder ", folder.string(), ": other servers use it"));
}

/// All that a cache begins with, and its lock, not yet locked.
bool GitCache::make_folders()
{
    std::error_code failed;
    fs::create_directories(folder_.parent_path(), failed);
    FileDescriptor const parent(::open(folder_.parent_path().c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (!parent)
        return false;
    // In a shared folder such as /tmp somebody else may have been there first.
    auto const own = open_own_folder(parent.get(), folder_, Foreign::refuse, notices_);
    if (!own)
        return false;
    for (auto const* const name : {"incoming", "repositories"})
        if (!open_own_folder(own->get(), folder_ / name, Foreign::set_aside, notices_))
            return false;
    keep_folders_apart(folder_ / "incoming");
    lock_ = FileDescriptor(
        ::openat(own->get(), "lock", O_RDWR | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0600));
    if (!lock_ && set_aside(own->get(), "lock", folder_ / "lock"))
        lock_ = FileDescriptor(::openat(own->get(), "lock", O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
    return static_cast<bool>(lock_);
}

/// After somebody has removed the cache.
bool GitCache::restore_folders()
{
    std::error_code failed;
    std::lock_guard const lock(mutex_);
    return fs::exists(folder_ / "incoming", failed) ||
           (make_folders() && ::flock(lock_.get(), LOCK_EX | LOCK_NB) == 0);
}

void GitCache::scan()
{
    std::error_code failed;
    // Downloads of the server before us, which nobody goes on with.
    for (auto const& left_over : fs::directory_iterator(folder_ / "incoming", failed))
        remove_tree(left_over.path());
    for (auto const& repository : fs::directory_iterator(folder_ / "repositories", failed)) {
        if (!is_folder(repository)) {
            remove_tree(repository.path());
            continue;
        }
        auto const before = stored_.size();
        for (auto const& entry : fs::directory_iterator(repository.path(), failed)) {
            if (is_folder(entry) && entry.path().filename() == "refs")
                continue;
            if (!is_folder(entry)) {
                remove_tree(entry.path());
                continue;
            }
            auto const text = read_file(AT_FDCWD, (entry.path() / "index").c_str(), max_index_size);
            auto const index = text ? parse_index(*text) : result<GitIndex>(text.error());
            // Without both of them nobody can tell what it is: it is fetched again.
            if (!index || !fs::exists(entry.path() / "proof", failed)) {
                remove_tree(entry.path());
                continue;
            }
            Stored stored;
            stored.bytes = bytes_of(*index);
            stored.used = fs::last_write_time(entry.path() / "index", failed);
            stored_.emplace(entry.path().string(), stored);
        }
        // What its refs mean is gone.
        if (stored_.size() == before)
            remove_tree(repository.path());
    }
}

/// What the refs mean whose folders are still there.
void GitCache::list_projects()
{
    constexpr std::size_t max_files = 10'000; // of refs, that are read
    std::vector<std::pair<fs::file_time_type, std::uint32_t>> found;
    std::error_code failed;
    for (auto const& repository : fs::directory_iterator(folder_ / "repositories", failed))
        for (auto const& ref : fs::directory_iterator(repository.path() / "refs", failed)) {
            auto const text = read_file(AT_FDCWD, ref.path().c_str(), max_ref_size);
            auto const meaning = text ? parse_ref(*text) : std::nullopt;
            if (!meaning || found.size() == max_files)
                continue;
            auto const stored = stored_.find((repository.path() / snapshot_name(meaning->target)).string());
            if (stored != stored_.end())
                found.emplace_back(stored->second.used, meaning->project);
        }
    std::ranges::sort(found, std::greater());
    found.resize(std::min(found.size(), LoadReport::max_projects));
    for (auto const& [used, project] : found)
        projects_at_start_.push_back(project);
}

fs::path GitCache::repository(std::string const& url) const
{
    return folder_ / "repositories" / digest_of(url);
}

/// File systems choose the place of a folder by its name: one that was used before is where files were
/// deleted just now.
fs::path GitCache::fresh_path() const
{
    return folder_ / "incoming" / make_token();
}

/// Reads a folder; outside the lock, since that takes as long as there are files. `known` is what is known
/// of it, and then what is known now.
GitContent GitCache::load(fs::path const& folder, GitSnapshot& snapshot, Known& known,
                          std::atomic<bool> const* aborted)
{
    auto const text = read_file(AT_FDCWD, (folder / "index").c_str(), max_index_size);
    auto index = text ? parse_index(*text) : result<GitIndex>(text.error());
    if (!index)
        return GitContent::changed;
    GitDigest digest;
    digest.update(*text);
    auto const index_digest = digest.finish();
    // The first time since the server has started: the proof must lead from the commit to this index. After
    // that, the digest of the index is enough.
    if (!known.index) {
        auto const target = proven_target(folder, *index);
        if (!target)
            return GitContent::changed;
        known.target = *target;
        known.index = index_digest;
    }
    if (*known.index != index_digest)
        return GitContent::changed;
    snapshot.target = known.target;
    snapshot.files = folder / "files";
    // Names, sizes and times of change are quickly looked at; contents are read again only where these
    // differ, or could.
    auto const look = look_at(*index, snapshot.files);
    if (!look)
        return GitContent::changed;
    auto content = GitContent::intact;
    if (!known.look || *known.look != look->digest) {
        content = check_content(*index, snapshot.files, aborted);
        known.look = look->settled ? std::optional(look->digest) : std::nullopt;
    }
    snapshot.index = std::move(*index);
    return content;
}

/// The index is in memory for as long as somebody uses the folder.
void GitCache::pay_for_index(GitSnapshot& snapshot)
{
    FetchBytes price;
    price.memory = memory_of(snapshot.index);
    snapshot.grant = FetchGrant(budget_);
    snapshot.grant.take_anyway(price);
}

void GitCache::complain_of(std::string const& url)
{
    if (notices_.size() < max_notices)
        notices_.push_back(concat("What the cache held of ", core::printable(url, 200),
                                  " was changed after it had been fetched: it is fetched again."));
}

void GitCache::note(std::string sentence)
{
    std::lock_guard const lock(mutex_);
    if (notices_.size() < max_notices)
        notices_.push_back(std::move(sentence));
}

std::vector<std::string> GitCache::take_notices()
{
    std::lock_guard const lock(mutex_);
    return std::exchange(notices_, {});
}

GitSnapshotPtr GitCache::find(std::string const& url, core::GitTarget const& target,
                              std::atomic<bool> const* aborted)
{
    auto const folder = repository(url) / snapshot_name(target);
    auto snapshot = open_stored(url, folder, aborted);
    if (!snapshot)
        return nullptr;
    std::lock_guard const lock(mutex_);
    if (auto const found = stored_.find(folder.string()); found != stored_.end()) {
        found->second.used = fs::file_time_type::clock::now();
        std::error_code ignored;
        fs::last_write_time(folder / "index", found->second.used, ignored);
    }
    return snapshot;
}

/// A stored folder whose content was looked at. Null when there is none, when it was changed, and when it
/// could not be looked at.
GitSnapshotPtr GitCache::open_stored(std::string const& url, fs::path const& folder,
                                     std::atomic<bool> const* aborted)
{
    Known known;
    {
        std::lock_guard const lock(mutex_);
        auto const found = stored_.find(folder.string());
        if (found == stored_.end())
            return nullptr;
        known = found->second.known;
    }
    auto loaded = std::make_shared<GitSnapshot>();
    auto const content = load(folder, *loaded, known, aborted);
    // It was read without the lock, and may have been dropped meanwhile.
    std::lock_guard const lock(mutex_);
    auto const found = stored_.find(folder.string());
    if (found == stored_.end() || content == GitContent::unknown)
        return nullptr;
    if (content == GitContent::changed) {
        drop(folder);
        complain_of(url);
        return nullptr;
    }
    found->second.known = known;
    // Everyone shares one object: its use count tells whether the folder is in use.
    if (auto open = found->second.open.lock())
        return open;
    pay_for_index(*loaded);
    found->second.open = loaded;
    return loaded;
}

bool GitCache::knows(std::string const& url, core::GitObjectId const& commit) const
{
    auto const start = concat((repository(url) / to_hex(commit)).string(), "-");
    std::lock_guard const lock(mutex_);
    return std::any_of(stored_.begin(), stored_.end(),
                       [&](auto const& each) { return each.first.starts_with(start); });
}

std::vector<GitSnapshotPtr> GitCache::relatives(std::string const& url)
{
    constexpr std::size_t max = 4; // those used last
    auto const home = repository(url);
    std::vector<std::pair<fs::file_time_type, std::string>> paths;
    {
        std::lock_guard const lock(mutex_);
        for (auto const& [path, stored] : stored_)
            if (fs::path(path).parent_path() == home)
                paths.emplace_back(stored.used, path);
    }
    std::sort(paths.rbegin(), paths.rend());
    std::vector<GitSnapshotPtr> found;
    for (auto const& [used, path] : paths) {
        if (found.size() == max)
            break;
        if (auto relative = open_stored(url, path, nullptr))
            found.push_back(std::move(relative));
    }
    return found;
}

result<GitIncoming> GitCache::begin()
{
    auto const folder = fresh_path();
    if (::mkdir(folder.c_str(), 0700) == 0)
        return GitIncoming(folder);
    if (errno == ENOENT && restore_folders() && ::mkdir(folder.c_str(), 0700) == 0)
        return GitIncoming(folder);
    return disk_failure();
}

result<GitSnapshotPtr> GitCache::publish(GitIncoming const& incoming, std::string const& url,
                                         core::GitTarget const& target, GitIndex index,
                                         std::string const& proof)
{
    auto const text = write_index(index);
    if (auto const written = write_file(AT_FDCWD, (incoming.folder() / "index").c_str(), text, 0644);
        !written)
        return written.error();
    if (auto const written = write_file(AT_FDCWD, (incoming.folder() / "proof").c_str(), proof, 0644);
        !written)
        return written.error();
    GitDigest digest;
    digest.update(text);
    auto const folder = repository(url) / snapshot_name(target);
    std::lock_guard const lock(mutex_);
    std::error_code failed;
    fs::create_directories(folder.parent_path() / "refs", failed);
    if (auto const twin = stored_.find(folder.string()); twin != stored_.end())
        if (auto open = twin->second.open.lock())
            return open; // another ref of the same commit was faster
    // What had this name goes, and the new folder is there at once, as a whole.
    drop(folder);
    if (::rename(incoming.folder().c_str(), folder.c_str()) != 0)
        return disk_failure();
    auto snapshot = std::make_shared<GitSnapshot>();
    snapshot->files = folder / "files";
    snapshot->target = target;
    snapshot->index = std::move(index);
    pay_for_index(*snapshot);
    Stored stored;
    stored.bytes = bytes_of(snapshot->index);
    stored.used = fs::file_time_type::clock::now();
    stored.open = snapshot;
    stored.known.index = digest.finish();
    stored.known.target = target;
    stored_[folder.string()] = stored;
    return GitSnapshotPtr(snapshot);
}

void GitCache::drop(fs::path const& folder)
{
    std::weak_ptr<GitSnapshot const> open;
    if (auto const stored = stored_.find(folder.string()); stored != stored_.end()) {
        open = stored->second.open;
        stored_.erase(stored);
    }
    std::error_code failed;
    if (!fs::exists(folder, failed))
        return;
    // Renamed first: half a folder must never be found under its name.
    auto const doomed = fresh_path();
    auto const renamed = ::rename(folder.c_str(), doomed.c_str()) == 0; // which takes room, too
    dropped_.emplace_back(renamed ? doomed : folder, open);
    remove_unused();
}

/// Of what was dropped. A simulation may have it mounted.
void GitCache::remove_unused()
{
    std::erase_if(dropped_, [](auto const& dropped) {
        auto const& [folder, user] = dropped;
        return user.expired() && remove_tree(folder).has_value();
    });
}

bool GitCache::trim()
{
    return trim_to(config_.cache_bytes);
}

bool GitCache::make_room()
{
    return trim_to(0);
}

/// True when something was removed.
bool GitCache::trim_to(std::uint64_t max_bytes)
{
    std::lock_guard const lock(mutex_);
    remove_unused();
    bool removed = false;
    std::uint64_t total = 0;
    for (auto const& [path, stored] : stored_)
        total += stored.bytes;
    while (total > max_bytes) {
        auto oldest = stored_.end();
        for (auto each = stored_.begin(); each != stored_.end(); ++each)
            if (each->second.open.expired() &&
                (oldest == stored_.end() || each->second.used < oldest->second.used))
                oldest = each;
        if (oldest == stored_.end())
            break; // everything is in use
        total -= oldest->second.bytes;
        fs::path const path = oldest->first;
        drop(path);
        forget_empty(path.parent_path());
        removed = true;
    }
    return removed;
}

void GitCache::forget_empty(fs::path const& repository)
{
    auto const is_there = [&](auto const& each) { return fs::path(each.first).parent_path() == repository; };
    if (std::none_of(stored_.begin(), stored_.end(), is_there))
        remove_tree(repository);
}

void GitCache::remember(std::string const& url, std::string const& ref_and_folder,
                        core::GitTarget const& target)
{
    if (core::names_commit(ref_and_folder))
        return; // it always means the same
    auto const folder = repository(url) / "refs";
    auto const path = folder / digest_of(ref_and_folder);
    auto const text = write_ref(target, project_key_of(url, ref_and_folder));
    std::lock_guard const lock(mutex_);
    auto const known = read_file(AT_FDCWD, path.c_str(), max_ref_size);
    if (known && *known == text)
        return;
    std::error_code failed;
    fs::create_directories(folder, failed);
    auto const fresh = fresh_path();
    if (write_file(AT_FDCWD, fresh.c_str(), text, 0644))
        fs::rename(fresh, path, failed);
}

void GitCache::forget(std::string const& url, std::string const& ref_and_folder)
{
    std::error_code ignored;
    std::lock_guard const lock(mutex_);
    fs::remove(repository(url) / "refs" / digest_of(ref_and_folder), ignored);
}

std::optional<core::GitTarget> GitCache::recall(std::string const& url,
                                                std::string const& ref_and_folder) const
{
    auto const text =
        read_file(AT_FDCWD, (repository(url) / "refs" / digest_of(ref_and_folder)).c_str(), max_ref_size);
    auto meant = text ? parse_ref(*text) : std::nullopt;
    if (!meant)
        return std::nullopt;
    return std::move(meant->target);
}

} // namespace webots_cloud::adapters
