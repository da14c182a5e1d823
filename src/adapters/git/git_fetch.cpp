#include "git_fetch.hpp"

#include "adapters/files/project_files.hpp"
#include "git_lfs.hpp"
#include "git_parent_files.hpp"

#include "core/git/git_history.hpp"
#include "core/text.hpp"

#include <boost/asio/error.hpp>

#include <fcntl.h>

#include <algorithm>
#include <unordered_set>

namespace webots_cloud::adapters {
namespace {

using core::concat;
using Kind = core::GitTreeEntry::Kind;

constexpr Duration max_fetch_time = std::chrono::hours(24); // later than that, the sum could overflow
constexpr std::size_t wants_at_once = 10'000; // half a megabyte: proxies limit the size of requests

// Of memory, in bytes, about: what is not counted object by object.
constexpr std::uint64_t memory_of_refs = std::uint64_t{16} << 20;    // of 8 MB that a server may list
constexpr std::uint64_t memory_of_libgit2 = std::uint64_t{64} << 20; // of the same
// A conversation that waits for a download.
constexpr std::uint64_t memory_in_queue = std::uint64_t{256} << 10;
// Buffers on the way, and one file of a megabyte.
constexpr std::uint64_t memory_of_download = std::uint64_t{4} << 20;
constexpr std::uint64_t memory_of_plan = std::uint64_t{96} << 20; // of 50,000 files with the longest paths
constexpr std::uint64_t max_memory_of_entries = std::uint64_t{48} << 20; // of one folder: 100,000
constexpr std::uint64_t memory_of_item = 512; // plan, index, its text; the path comes 4 times
constexpr std::uint64_t max_memory_of_item = memory_of_item + 4 * 1024;

constexpr char no_single_files[] = "the git server does not hand out single files";

// Of a commit that was asked for by its hash.
constexpr std::string_view on_no_branch = "is on no branch and under no tag";
constexpr std::string_view not_newest =
    "is not the newest one of any branch or tag, and the git server can't "
    "tell whether it is an older one";
constexpr std::string_view not_looked_for = "is not looked for, as the history is too large";

GitDonors donors_among(std::vector<GitSnapshotPtr> const& relatives, std::vector<FileDescriptor>& folders)
{
    GitDonors donors;
    for (auto const& relative : relatives) {
        auto folder = open_folder(AT_FDCWD, relative->files.c_str());
        if (!folder)
            continue;
        for (auto const& entry : relative->index.entries) {
            if (entry.kind != Kind::file && entry.kind != Kind::executable)
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

/// As git and JGit say it.
bool is_unknown_commit(Failure const& failure)
{
    auto const says = [&](char const* words) { return failure.detail().find(words) != std::string::npos; };
    return failure == errc::protocol_error && (says("not our ref") || (says("want ") && says(" not valid")));
}

/// Ours are; those of libraries and servers have no full stop, or no capital.
bool is_sentence(std::string_view words) noexcept
{
    return words.ends_with('.') && words.front() >= 'A' && words.front() <= 'Z';
}

std::string_view without_full_stop(std::string_view words) noexcept
{
    return words.substr(0, words.find_last_not_of('.') + 1);
}

std::uint64_t memory_of_items(std::vector<core::GitLayoutItem> const& plan)
{
    constexpr std::uint64_t copies = 4;
    std::uint64_t bytes = 0;
    for (auto const& item : plan)
        bytes += memory_of_item + copies * item.path.size();
    return bytes;
}

std::uint64_t memory_of_files(GitDonors const& donors)
{
    constexpr std::uint64_t each = 224;
    std::uint64_t bytes = 0;
    for (auto const& [id, file] : donors.files)
        bytes += each + file.path.size() + file.pointer.size();
    return bytes;
}

/// Some servers send only commits, whatever they announce.
Failure about_files(Failure const& failure)
{
    if (is_unknown_commit(failure))
        return {errc::protocol_error, no_single_files};
    return failure;
}

bool is_about_filters(Failure const& failure)
{
    return failure.detail() == no_single_files || failure.detail().find("filter") != std::string::npos;
}

} // namespace

/// A download in the making.
struct GitFetch::Download
{
    Download(GitIncoming folder, FileDescriptor objects_folder, GitCapabilities offered, FetchShare& share)
        : incoming(std::move(folder)), objects(std::move(objects_folder)), staging(objects.get(), &share),
          capabilities(offered)
    {}

    GitIncoming incoming;
    FileDescriptor objects;
    GitStaging staging;
    GitCapabilities capabilities;
    std::uint32_t files_wanted = 0; ///< That were asked for by name.
    std::uint32_t files_read = 0;
};

GitFetch::GitFetch(CurlHttp& http, GitCache& cache, GitServers& servers, GitSourceParams const& params,
                   std::shared_ptr<FetchBudget> budget, GitFetchOrder order)
    : http_(http), cache_(cache), servers_(servers), params_(params), budget_(std::move(budget)),
      order_(std::move(order)), url_(order_.project.clone_url())
{}

void GitFetch::start_clock()
{
    deadline_ = std::chrono::steady_clock::now() + std::min<Duration>(order_.limits.timeout, max_fetch_time);
    if (share_)
        return;
    FetchShare::Waiting waiting;
    waiting.interrupt = [this] { return may_go_on(); };
    waiting.tell = [progress = order_.progress](bool waits) {
        if (progress)
            progress->report_waiting(waits);
    };
    share_ = std::make_unique<FetchShare>(budget_, std::move(waiting));
}

result<> GitFetch::take_memory(std::uint64_t bytes)
{
    FetchBytes price;
    price.memory = bytes;
    return share_->take(price);
}

result<> GitFetch::may_go_on() const
{
    if (order_.aborted && order_.aborted->load(std::memory_order_relaxed))
        return Failure(boost::asio::error::operation_aborted);
    if (std::chrono::steady_clock::now() > deadline_)
        return Failure(errc::timed_out, "The project took too long to unpack.");
    return {};
}

CurlLimits GitFetch::http_limits(std::uint64_t bytes) const
{
    CurlLimits limits;
    limits.aborted = order_.aborted;
    limits.deadline = deadline_;
    limits.bytes = bytes;
    limits.low_speed = params_.low_speed;
    limits.low_speed_time = params_.low_speed_time;
    return limits;
}

GitRemote GitFetch::remote() const
{
    GitRemote remote;
    remote.base = order_.project.forge;
    remote.url = url_;
    return remote;
}

GitClient GitFetch::client(std::uint64_t bytes)
{
    return GitClient(http_, remote(), http_limits(bytes));
}

/// For a question that the cache could answer, if need be, it does not wait as long as for others.
GitClient GitFetch::client_for_refs()
{
    auto limits = http_limits(max_git_ref_bytes);
    if (cache_.recall(url_, order_.project.ref_and_folder))
        limits.deadline = std::min(limits.deadline, std::chrono::steady_clock::now() + params_.patience);
    return GitClient(http_, remote(), std::move(limits));
}

result<Git2Client*> GitFetch::libgit2()
{
    if (!libgit2_) {
        auto scratch = cache_.begin();
        if (!scratch)
            return scratch.error();
        if (auto const taken = take_memory(memory_of_libgit2); !taken)
            return taken.error();
        auto server = remote();
        server.version_2 = false;
        libgit2_ = std::make_unique<Git2Client>(http_, std::move(server), http_limits(order_.limits.bytes),
                                                std::move(*scratch));
    }
    return libgit2_.get();
}

std::string GitFetch::not_reached(Failure const& failure) const
{
    return concat(order_.project.forge, " can't be reached: ", without_full_stop(failure.message()), ".");
}

/// What went wrong, as a sentence for the person who asked: most of it is the words of a server or of a
/// library.
Failure GitFetch::explain(Failure const& failure) const
{
    if (failure.code() == boost::asio::error::operation_aborted || is_sentence(failure.message()))
        return failure;
    auto const& project = order_.project;
    auto const repository = concat("Repository ", project.owner, "/", project.repository, " ");
    if (is_unknown_commit(failure))
        return {errc::not_found, concat(repository, "has no such commit.")};
    auto const message = failure.message();
    auto const words = without_full_stop(message);
    if (failure == errc::not_found || words.starts_with("has "))
        return {failure.code(), concat(repository, words, ".")};
    if (failure == errc::unreachable || failure == errc::timed_out)
        return {failure.code(), concat(not_reached(failure), " Try again later.")};
    return {failure.code(), concat(project.forge, ": ", words, ".")};
}

std::optional<result<GitFetched>> GitFetch::look_up()
{
    start_clock();
    FetchShare::Loan const loan(*share_);
    if (servers_.is_missing(url_))
        return explain({errc::not_found, "does not exist or is private"});
    auto target = resolve();
    if (!target && target.error() == errc::not_found)
        cache_.forget(url_, order_.project.ref_and_folder);
    if (!target)
        return fall_back(target.error());
    target_ = std::move(*target);
    GitFetched fetched;
    fetched.snapshot = cache_.find(url_, target_, order_.aborted);
    if (!fetched.snapshot) {
        if (libgit2_ && libgit2_->memory_of_refs() > memory_in_queue)
            libgit2_.reset();
        return std::nullopt;
    }
    cache_.remember(url_, order_.project.ref_and_folder, target_);
    return fetched;
}

result<GitFetched> GitFetch::download()
{
    start_clock(); // for its turn it has waited through no fault of the server's
    FetchShare::Loan const loan(*share_);
    auto downloaded = download_target();
    libgit2_.reset();
    if (!downloaded)
        return explain(downloaded.error());
    cache_.trim();
    cache_.remember(url_, order_.project.ref_and_folder, target_);
    GitFetched fetched;
    fetched.snapshot = std::move(*downloaded);
    return fetched;
}

result<core::GitTarget> GitFetch::resolve()
{
    auto const& wanted = order_.project.ref_and_folder;
    if (core::names_commit(wanted))
        return resolve_commit();
    auto const refs = list_refs(core::ref_prefixes(wanted));
    if (!refs)
        return refs.error();
    return core::resolve_ref(wanted, *refs);
}

/// A server hands out whatever lies in its store, and forges keep forks and pull requests there too. The
/// repository's own is what its branches and tags lead to; of what is in the cache that is known. To look
/// through a history takes long: it is left to the download.
result<core::GitTarget> GitFetch::resolve_commit()
{
    auto target = core::resolve_ref(order_.project.ref_and_folder, {});
    if (!target || cache_.knows(url_, target->commit))
        return target;
    auto const refs = list_refs(core::all_ref_prefixes());
    if (!refs)
        return refs.error();
    auto tips = core::git_tips(*refs);
    if (std::find(tips.begin(), tips.end(), target->commit) == tips.end())
        may_be_from_ = std::move(tips);
    return target;
}

/// Errors: `not_found`, `too_large`, when this server can't tell.
result<> GitFetch::can_check_history(GitCapabilities const& capabilities,
                                     core::GitObjectId const& commit) const
{
    if (!capabilities.version_2 || !capabilities.filter)
        return about_commit(errc::not_found, not_newest, commit);
    if (may_be_from_->size() > wants_at_once)
        return about_commit(errc::too_large, not_looked_for, commit);
    return {};
}

/// Looks for the commit in the history of the tips. `files` come along where the server lets them: a round
/// trip saved.
result<> GitFetch::check_history(Download& state, core::GitObjectId const& commit, Ids const& files)
{
    auto const received = received_;
    auto const unpacked = unpacked_;
    auto const together = may_be_from_->size() + files.size() <= wants_at_once;
    auto fetched = fetch_history(state, together ? files : Ids());
    auto const refused = [&] {
        return fetched.error() == errc::too_large || fetched.error() == errc::protocol_error;
    };
    if (!fetched && refused() && together && !files.empty()) {
        give_up(received, unpacked);
        fetched = fetch_history(state, {});
    }
    answered_ = true; // it was no question about capabilities
    if (!fetched && refused())
        return fetched.error() == errc::too_large ? about_commit(errc::too_large, not_looked_for, commit)
                                                  : about_commit(errc::not_found, not_newest, commit);
    if (!fetched)
        return fetched.error();
    auto const lookup = [&](core::GitObjectId const& id) {
        return may_go_on() ? state.staging.find(id) : nullptr;
    };
    FetchShare::Loan const loan(*share_);
    constexpr std::uint64_t growth = 3; // of a line that names a parent: seen, and waiting to be looked at
    if (auto const taken = take_memory(growth * state.staging.memory()); !taken)
        return taken.error();
    auto const found = core::is_in_git_history(commit, *may_be_from_, lookup);
    if (auto const going_on = may_go_on(); !going_on)
        return going_on.error();
    if (!found)
        return about_commit(errc::not_found, on_no_branch, commit);
    may_be_from_.reset();
    return {};
}

/// All commits that the tips lead to, and `files`: a filter leaves out nothing that is asked for by name.
result<> GitFetch::fetch_history(Download& state, Ids const& files)
{
    GitWants wants;
    wants.ids = *may_be_from_;
    wants.ids.insert(wants.ids.end(), files.begin(), files.end());
    wants.filter = git_filter_files_and_folders;
    state.files_wanted = static_cast<std::uint32_t>(files.size());
    return wants.ids.empty() ? result<>() : fetch_pack(state, wants);
}

Failure GitFetch::about_commit(errc code, std::string_view what, core::GitObjectId const& commit) const
{
    constexpr std::size_t digits = 12;
    return {code,
            concat("Commit ", to_hex(commit).substr(0, digits), " of ", order_.project.owner, "/",
                   order_.project.repository, " ", what, ": name a branch or tag, or have one made for it.")};
}

/// What the server lists: all that begin with `prefixes`, and maybe more.
result<GitFetch::Refs> GitFetch::list_refs(std::vector<std::string> const& prefixes)
{
    if (auto const taken = take_memory(memory_of_refs); !taken)
        return taken.error();
    if (!servers_.capabilities(order_.project.forge).version_2)
        return list_refs_with_libgit2();
    auto refs = client_for_refs().ls_refs(prefixes);
    if (refs)
        return refs;
    auto const may_be_old = refs.error() == errc::protocol_error && !servers_.knows(order_.project.forge);
    if (may_be_old || refs.error() == errc::not_found)
        return ask_again(refs.error());
    return refs.error();
}

/// Queries the capabilities after a failed `ls-refs`: a server without version 2 does not understand that
/// request, and for one that only serves files its address does not exist.
result<GitFetch::Refs> GitFetch::ask_again(Failure const& failure)
{
    auto const offered = client(max_git_ref_bytes).capabilities();
    if (offered && !offered->version_2) {
        servers_.set_capabilities(order_.project.forge, *offered);
        return list_refs_with_libgit2();
    }
    if (offered.has_error() && offered.error() == errc::refused)
        return offered.error();
    if (failure != errc::not_found)
        return failure;
    if (offered.has_error() && offered.error() != errc::not_found)
        return offered.error();
    servers_.set_missing(url_);
    return failure;
}

result<GitFetch::Refs> GitFetch::list_refs_with_libgit2()
{
    auto const peer = libgit2();
    if (!peer)
        return peer.error();
    auto refs = (*peer)->ls_refs();
    if (!refs && refs.error() == errc::not_found)
        servers_.set_missing(url_);
    return refs;
}

/// When the server can't be asked, what it said last is better than nothing.
result<GitFetched> GitFetch::fall_back(Failure const& failure)
{
    if (failure == errc::unreachable || failure == errc::timed_out || failure == errc::protocol_error) {
        if (auto const target = cache_.recall(url_, order_.project.ref_and_folder)) {
            GitFetched fetched;
            fetched.snapshot = cache_.find(url_, *target, order_.aborted);
            fetched.notice = concat(not_reached(failure), " Starting ", order_.project.owner, "/",
                                    order_.project.repository, " from the cache.");
            if (fetched.snapshot)
                return fetched;
        }
    }
    return explain(failure);
}

/// Tries with all that git servers usually can do, and only if that fails asks what this one can: a round
/// trip saved.
result<GitSnapshotPtr> GitFetch::download_target()
{
    auto const& forge = order_.project.forge;
    auto downloaded = download_with(servers_.capabilities(forge), target_);
    if (downloaded || answered_ || is_unknown_commit(downloaded.error()) || servers_.knows(forge))
        return downloaded;
    auto offered = client(max_git_ref_bytes).capabilities();
    if (!offered)
        return offered.error();
    if (!offered->version_2) {
        servers_.set_capabilities(forge, *offered);
    } else if (offered->filter && offered->shallow) {
        if (!is_about_filters(downloaded.error()))
            return downloaded;   // it can do what was asked: something else is wrong
        offered->filter = false; // it promises more than it keeps
    }
    auto again = download_with(*offered, target_);
    if (again)
        servers_.set_capabilities(forge, *offered);
    return again;
}

result<GitFetch::Download> GitFetch::begin_download(GitCapabilities const& capabilities)
{
    auto incoming = cache_.begin();
    if (!incoming)
        return incoming.error();
    auto objects = make_folder(AT_FDCWD, (incoming->folder() / "objects").c_str());
    if (!objects)
        return objects.error();
    return Download(std::move(*incoming), std::move(*objects), capabilities, *share_);
}

/// A second time where a full disk can be helped.
result<GitSnapshotPtr> GitFetch::download_with(GitCapabilities const& capabilities,
                                               core::GitTarget const& target)
{
    auto downloaded = download_once(capabilities, target);
    if (downloaded || !is_lack_of_room(downloaded.error()) || !cache_.make_room())
        return downloaded;
    received_ = unpacked_ = 0;
    return download_once(capabilities, target);
}

result<GitSnapshotPtr> GitFetch::download_once(GitCapabilities const& capabilities,
                                               core::GitTarget const& target)
{
    FetchShare::Loan const loan(*share_); // given back when there is nothing left of what it pays for
    if (auto const taken = take_memory(memory_of_download); !taken)
        return taken.error();
    auto begun = begin_download(capabilities);
    if (!begun)
        return begun.error();
    auto& state = *begun;
    std::vector<FileDescriptor> donor_folders;
    auto const relatives = cache_.relatives(url_);
    auto donors = donors_among(relatives, donor_folders);
    if (!take_memory(memory_of_files(donors)))
        donors.files.clear(); // it goes without them, too

    GitWants wants;
    wants.ids = {target.commit};
    wants.shallow = capabilities.shallow;
    if (capabilities.version_2 && capabilities.filter && (!target.folder.empty() || !donors.files.empty()))
        wants.filter = git_filter_files;
    // Whose the commit is should be known before much of it travels: before its files do, or with them.
    if (may_be_from_) {
        auto checked = can_check_history(capabilities, target.commit);
        if (checked && wants.filter.empty())
            checked = check_history(state, target.commit, {});
        if (!checked)
            return checked.error();
    }
    if (auto const fetched = fetch_pack(state, wants); !fetched)
        return fetched.error();
    GitProof proof(target.folder);
    auto way = way_to_folder(state, target, proof);
    if (!way)
        return way.error();
    core::GitLayoutLimits limits;
    limits.items = order_.limits.files;
    auto const interrupt = [this] { return may_go_on(); };
    result<> paid_for_plan;
    std::uint64_t plan_memory = 0;
    auto const lookup = [&](core::GitObjectId const& id) -> std::string const* {
        auto const* const folder = interrupt() ? state.staging.find(id) : nullptr;
        if (folder && paid_for_plan)
            paid_for_plan = pay_for_folder(*folder, plan_memory);
        if (folder && paid_for_plan && !proof.has_tree(id))
            paid_for_plan = take_memory(folder->size());
        if (!folder || !paid_for_plan)
            return nullptr;
        proof.add_tree(id, *folder);
        return folder;
    };
    auto plan = core::lay_out_git_folder(*way, limits, lookup);
    if (auto const going_on = interrupt(); !going_on)
        return going_on.error();
    if (!paid_for_plan)
        return paid_for_plan.error();
    if (!plan)
        return plan.error();
    FetchBytes spare;
    spare.memory = plan_memory - std::min(plan_memory, memory_of_items(*plan));
    share_->give_back(spare);
    if (auto const fetched = fetch_rest(state, target.commit, *plan, donors); !fetched)
        return fetched.error();
    if (!may_keep_parent_files(*plan, state.staging, donors, order_.limits.bytes))
        way->left_out = leave_out_parent_files(*plan) || way->left_out;
    if (way->left_out)
        note_lack_of_parents();

    auto const files = make_folder(AT_FDCWD, (state.incoming.folder() / "files").c_str());
    if (!files)
        return files.error();
    if (auto const paid = pay_for_files(*plan, state.staging, donors); !paid)
        return paid.error();
    auto index = unpack_git_folder(*plan, state.staging, donors, files->get(), interrupt);
    if (!index)
        return index.error();
    if (auto const fetched = fetch_large_files(state, *index, files->get()); !fetched)
        return fetched.error();
    std::error_code ignored;
    std::filesystem::remove_all(state.incoming.folder() / "objects", ignored);
    return cache_.publish(state.incoming, url_, target, std::move(*index), proof.text());
}

/// For what a folder becomes in a plan, whatever the path to it: before it is looked into. `taken`: for the
/// plan so far.
result<> GitFetch::pay_for_folder(std::string const& folder, std::uint64_t& taken)
{
    constexpr std::uint64_t min_entry_size = 27;
    auto const wanted = (folder.size() / min_entry_size + 1) * max_memory_of_item;
    auto const more = std::min(wanted, memory_of_plan - taken);
    auto paid = take_memory(more);
    if (paid)
        taken += more;
    return paid;
}

/// For the entries of a folder that is looked into on the way; `taken`: for the largest so far.
result<> GitFetch::pay_for_entries(std::string const& folder, std::uint64_t& taken)
{
    constexpr std::uint64_t growth = 4;
    auto const wanted = std::min(growth * folder.size(), max_memory_of_entries);
    if (wanted <= taken)
        return {};
    auto paid = take_memory(wanted - taken);
    if (paid)
        taken = wanted;
    return paid;
}

/// Before anything is made of the plan: a file that occurs many times may have to be copied each time.
result<> GitFetch::pay_for_files(std::vector<core::GitLayoutItem> const& plan, GitStaging const& staging,
                                 GitDonors const& donors)
{
    std::unordered_set<core::GitObjectId, core::GitObjectIdHash> moved;
    std::uint64_t bytes = 0;
    FetchBytes price;
    for (auto const& item : plan) {
        auto const is_file = item.kind == Kind::file || item.kind == Kind::executable;
        auto const donor = is_file ? donors.files.find(item.id) : donors.files.end();
        auto const is_here = is_file && donor == donors.files.end() && staging.has_blob(item.id);
        std::uint64_t size = 0; // links have a kilobyte at most
        if (is_here)
            size = staging.blob_size(item.id);
        else if (donor != donors.files.end())
            size = donor->second.size;
        bytes += size;
        if (!is_here || !moved.insert(item.id).second)
            price.disk += bytes_on_disk(size);
        if (bytes > order_.limits.bytes)
            return Failure(errc::too_large, concat("The project is larger than ",
                                                   std::to_string(order_.limits.bytes >> 20), " MB."));
    }
    return share_->take(price);
}

/// The way to the wanted folder, which must have a folder `worlds`.
result<core::GitWay> GitFetch::way_to_folder(Download& state, core::GitTarget const& target, GitProof& proof)
{
    FetchShare::Loan const loan(*share_); // for the entries of one folder after the other
    result<> paid;
    std::uint64_t taken = 0;
    auto const lookup = [&](core::GitObjectId const& id) -> std::string const* {
        auto const* const folder = state.staging.find(id);
        if (folder && paid)
            paid = pay_for_entries(*folder, taken);
        if (!folder || !paid)
            return nullptr;
        proof.add_tree(id, *folder);
        return folder;
    };
    auto const* const commit = state.staging.find(target.commit);
    if (!commit && !state.staging.has_blob(target.commit))
        return Failure(errc::protocol_error, "the git server left out the commit");
    auto const root = commit ? core::tree_of_commit(*commit) : result<core::GitObjectId>(Failure());
    if (!root)
        return Failure(errc::not_found,
                       concat("has no commit at \"", core::printable(order_.project.ref_and_folder, 100),
                              "\", but something else"));
    proof.add_commit(*commit);
    auto way = core::find_git_folder(*root, target.folder, core::GitLayoutLimits(), lookup);
    auto const* const folder = way ? lookup(way->tree) : nullptr;
    if (!paid)
        return paid.error();
    if (!way)
        return way.error();
    auto const entries = core::parse_git_tree(folder ? std::string_view(*folder) : std::string_view());
    if (!entries)
        return entries.error();
    if (std::none_of(entries->begin(), entries->end(),
                     [](auto const& entry) { return entry.name == "worlds"; }))
        return Failure(errc::not_found,
                       target.folder.empty()
                           ? "has no folder \"worlds\""
                           : concat("has no folder \"", core::printable(target.folder, 200), "/worlds\""));
    return way;
}

/// The files that the plan lacks, once it is known that the commit is the repository's own. Those of the
/// folders above come with the others, and the transfer is cut when they turn out to be too large.
result<> GitFetch::fetch_rest(Download& state, core::GitObjectId const& commit,
                              std::vector<core::GitLayoutItem> const& plan, GitDonors const& donors)
{
    auto const missing = missing_files(plan, state.staging, donors);
    GitParentFiles parents(plan, state.staging, donors);
    GitStaging::Watching const watching(state.staging, parents);
    if (may_be_from_)
        if (auto const checked = check_history(state, commit, missing); !checked)
            return checked;
    auto const received = received_;
    auto const unpacked = unpacked_;
    if (!parents.stopped()) {
        auto fetched = fetch_plan(state, plan, donors, missing.size(), true);
        if (fetched || !parents.stopped())
            return fetched;
        give_up(received, unpacked);
    }
    parents.ignore();
    auto fetched = fetch_plan(state, plan, donors, missing.size(), false);
    if (!fetched || parents.too_large())
        return fetched;
    // A large file had come: it was the project's own, or it comes again.
    parents.expect(plan, state.staging, donors);
    auto const received_before_them = received_;
    auto const unpacked_before_them = unpacked_;
    fetched = fetch_plan(state, plan, donors, missing.size(), true);
    if (fetched || !parents.stopped())
        return fetched;
    give_up(received_before_them, unpacked_before_them);
    return {};
}

/// What the plan lacks now, with or without the files of the folders above; of `wanted` files it lacked some
/// when this began.
result<> GitFetch::fetch_plan(Download& state, std::vector<core::GitLayoutItem> const& plan,
                              GitDonors const& donors, std::size_t wanted, bool parents)
{
    auto const missing = missing_files(plan, state.staging, donors);
    state.files_wanted = static_cast<std::uint32_t>(wanted);
    state.files_read = static_cast<std::uint32_t>(wanted - missing.size());
    return fetch_files(state, parents ? missing : missing_files(plan, state.staging, donors, false));
}

/// Does not count against the limits what was received since, and is not needed.
void GitFetch::give_up(std::uint64_t received, std::uint64_t unpacked)
{
    given_up_ += received_ - received;
    received_ = received;
    unpacked_ = unpacked;
}

/// Said once, when the project is fetched.
void GitFetch::note_lack_of_parents()
{
    auto const& project = order_.project;
    cache_.note(concat("The project in ", core::printable(target_.folder, 200), " of ", project.owner, "/",
                       project.repository,
                       " lacks the files of the folders above it, which are too large or ",
                       "too many (more than ", std::to_string(max_parent_bytes >> 20), " MB or ",
                       std::to_string(core::GitLayoutLimits().parent_files), ")."));
}

result<> GitFetch::fetch_files(Download& state, Ids const& files)
{
    if (!state.capabilities.version_2)
        return {}; // all that it has to give is there
    for (std::size_t begin = 0; begin < files.size(); begin += wants_at_once) {
        GitWants wants;
        auto const end = std::min(files.size(), begin + wants_at_once);
        wants.ids.assign(files.begin() + begin, files.begin() + end);
        if (auto const fetched = fetch_pack(state, wants); !fetched)
            return about_files(fetched.error());
    }
    return {};
}

result<> GitFetch::fetch_large_files(Download const& state, GitIndex& index, int files)
{
    LfsOrder order;
    order.forge = order_.project.forge;
    order.url = url_;
    order.repository = concat(order_.project.owner, "/", order_.project.repository);
    order.max_bytes = order_.limits.bytes;
    order.limits = http_limits(order_.limits.bytes);
    order.share = share_.get();
    order.progress = order_.progress;
    order.interrupt = [this] { return may_go_on(); };
    return fetch_lfs_files(http_, order, index, files, state.objects.get());
}

result<> GitFetch::fetch_pack(Download& state, GitWants const& wants)
{
    auto const& limits = order_.limits;
    GitPackReader pack(state.staging, limits.bytes - std::min(limits.bytes, unpacked_),
                       [this] { return may_go_on(); });
    auto const before = received_;
    auto const progress = [&](GitPackReader const& reader, std::uint64_t received) {
        received_ = before + received;
        report(state, wants, reader);
    };
    auto const fetched =
        state.capabilities.version_2
            ? client(limits.bytes - std::min(limits.bytes, before)).fetch(wants, pack, progress)
            : fetch_pack_with_libgit2(state, wants, pack, progress);
    unpacked_ += pack.unpacked();
    if (state.files_wanted > 0)
        state.files_read += pack.objects_read();
    answered_ = pack.begun() || fetched.has_value() || fetched.error() != errc::protocol_error;
    return fetched;
}

/// How much is still to come is known of the last pack only; a browser must not see it start anew.
void GitFetch::report(Download const& state, GitWants const& wants, GitPackReader const& pack)
{
    if (!order_.progress)
        return;
    auto const received = received_ + given_up_;
    if (!wants.filter.empty() && state.files_wanted == 0)
        order_.progress->report(0, 0, received);
    else if (wants.filter.empty() && state.files_wanted > 0)
        order_.progress->report(state.files_wanted,
                                std::min(state.files_wanted, state.files_read + pack.objects_read()),
                                received);
    else
        order_.progress->report(pack.objects_total(), pack.objects_read(), received);
}

/// The whole commit, always.
result<> GitFetch::fetch_pack_with_libgit2(Download& state, GitWants const& wants, GitPackReader& pack,
                                           GitClient::Progress const& progress)
{
    auto const peer = libgit2();
    if (!peer)
        return peer.error();
    auto const& commit = wants.ids.front();
    auto const fetched = (*peer)->fetch(commit, wants.shallow, pack, progress);
    if (fetched && !state.staging.find(commit))
        return Failure(errc::not_found, "has no such commit");
    return fetched;
}

} // namespace webots_cloud::adapters
