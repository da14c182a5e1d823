// Replaces the pointers of a checkout by the large files that they stand for. A stranger's LFS server says
// where these are: every address is checked (`check_lfs_address`) before anything is asked there, and what
// arrives is paid for in the budget of all fetches and compared with the digest in the pointer. What people
// are told of failures is decided by core/git/git_lfs_problem.
#include "git_lfs.hpp"

#include "adapters/files/folder_walk.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/files/sha256.hpp"
#include "adapters/git_packs/git_copy.hpp"
#include "adapters/http_client/proxied_host.hpp"

#include "core/access/public_networks.hpp"
#include "core/git/git_lfs_address.hpp"
#include "core/git/git_lfs_batch.hpp"
#include "core/git/git_lfs_pointer.hpp"
#include "core/git/git_lfs_problem.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <boost/asio/error.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <system_error>
#include <thread>
#include <unordered_map>
#include <vector>

namespace webots_cloud::adapters {
namespace {

using core::concat;
using Kind = core::GitTreeEntry::Kind;

constexpr std::size_t downloads_at_once = 4;
constexpr std::size_t max_hosts = 16; // that are looked up for one project
constexpr char media_type[] = "application/vnd.git-lfs+json";

// Of memory, in bytes, about.
constexpr std::uint64_t memory_of_pointer = 1024;                  // besides its text
constexpr std::uint64_t memory_of_batch = std::uint64_t{16} << 20; // an answer, and what a parser makes of it
constexpr std::uint64_t memory_of_file = std::uint64_t{1} << 20;

/// Content, and the files that have it.
struct LargeFile
{
    core::LfsPointer pointer;
    std::vector<std::size_t> entries; ///< Of the index; at least one.
};

/// Of a file on its way; one that is named by its content could be two of different sizes.
std::string name_of(core::LfsPointer const& pointer)
{
    return concat(pointer.object, "-", std::to_string(pointer.size));
}

std::string shown(GitIndexEntry const& entry)
{
    return concat("\"", core::printable(entry.path, 120), "\"");
}

mode_t mode_of(Kind kind)
{
    return kind == Kind::executable ? 0755 : 0644;
}

} // namespace

/// The large files of one checkout: found, paid for, fetched, and put in the place of their pointers.
class LfsFetch
{
public:
    LfsFetch(CurlHttp& http, LfsOrder order, GitIndex& index, int files, int scratch)
        : http_(http), order_(std::move(order)), problems_{order_.repository, order_.forge}, index_(index),
          files_(files), scratch_(scratch)
    {}

    result<> find_pointers();
    bool empty() const noexcept { return found_.empty(); }
    result<> pay();
    result<> fetch_all();

private:
    result<> note_pointer(std::size_t number, std::string text, core::LfsPointer pointer);
    result<> fetch_some(std::size_t first, std::size_t count);
    result<std::vector<core::LfsDownload>> ask_server(std::vector<core::LfsPointer> const& pointers);
    void receive_in_turn(std::vector<core::LfsDownload> const& downloads, std::size_t first);
    result<> receive(LargeFile const& file, core::LfsDownload const& from);
    result<> may_ask(std::string const& url);
    result<> may_mean(std::string const& host);
    result<> place(LargeFile const& file);
    void report(std::uint64_t more);

    std::string path_of(LargeFile const& file) const { return shown(index_.entries[file.entries.front()]); }

    CurlHttp& http_;
    LfsOrder order_;
    core::LfsProblems problems_;
    GitIndex& index_;
    int files_;
    int scratch_;
    std::vector<LargeFile> found_;
    std::unordered_map<std::string, std::size_t> numbers_; ///< In `found_`, by what is unique of a pointer.
    std::uint64_t total_ = 0;                              ///< Bytes to receive.
    std::optional<core::IpAddress> home_;                  ///< Of the forge, or of the proxy to it.

    // What the threads that receive share.
    std::atomic<std::size_t> next_{0};
    std::atomic<bool> abandoned_{false};
    std::mutex mutex_;
    std::uint64_t received_ = 0; ///< Guarded by the mutex, as is the next one.
    result<> outcome_;
    std::mutex hosts_mutex_;
    /// Hosts behind a proxy, and whether they may be asked. Guarded by the mutex before.
    std::unordered_map<std::string, result<>> hosts_;
};

// ---- what there is to fetch ----------------------------------------------------------------------------

result<> LfsFetch::find_pointers()
{
    FolderWalk walk(files_);
    for (std::size_t i = 0; i < index_.entries.size(); ++i) {
        auto const& entry = index_.entries[i];
        bool const is_file = entry.kind == Kind::file || entry.kind == Kind::executable;
        bool const may_be_one =
            entry.size >= core::shortest_lfs_pointer && entry.size <= core::max_lfs_pointer_length;
        if (!is_file || !may_be_one || !entry.pointer.empty()) // what an older folder had is complete
            continue;
        if (auto const may_go_on = ask(order_.interrupt); !may_go_on)
            return may_go_on.error();
        auto const folder = walk.parent_of(entry.path);
        if (!folder)
            return folder.error();
        auto text = read_file(*folder, file_name(entry.path), core::max_lfs_pointer_length);
        if (!text)
            return disk_failure();
        auto pointer = core::parse_lfs_pointer(*text);
        if (!pointer)
            continue;
        if (auto const noted = note_pointer(i, std::move(*text), std::move(*pointer)); !noted)
            return noted.error();
    }
    return {};
}

result<> LfsFetch::note_pointer(std::size_t number, std::string text, core::LfsPointer pointer)
{
    auto& entry = index_.entries[number];
    if (pointer.extended)
        return problems_.about_extension(shown(entry));
    FetchBytes price;
    price.memory = memory_of_pointer + 2 * text.size();
    if (auto const taken = order_.share->take(price); !taken)
        return taken.error();
    index_.bytes -= entry.size;
    if (pointer.size > order_.max_bytes - std::min(order_.max_bytes, index_.bytes))
        return core::refused(core::Refused::project_too_large,
                             {{"max", std::to_string(order_.max_bytes >> 20)}});
    index_.bytes += pointer.size;
    entry.size = pointer.size;
    entry.pointer = std::move(text);
    auto const [known, is_new] = numbers_.emplace(name_of(pointer), found_.size());
    if (is_new) {
        total_ += pointer.size;
        found_.emplace_back().pointer = std::move(pointer);
    }
    found_[known->second].entries.push_back(number);
    return {};
}

/// For the disk: a file that occurs many times may have to be copied each time.
result<> LfsFetch::pay()
{
    FetchBytes price;
    price.memory = downloads_at_once * memory_of_file;
    for (auto const& file : found_)
        price.disk += bytes_on_disk(file.pointer.size) * file.entries.size();
    return order_.share->take(price);
}

// ---- fetching ------------------------------------------------------------------------------------------

result<> LfsFetch::fetch_all()
{
    report(0);
    for (std::size_t first = 0; first < found_.size(); first += core::max_lfs_objects) {
        auto const count = std::min(core::max_lfs_objects, found_.size() - first);
        if (auto const fetched = fetch_some(first, count); !fetched)
            return fetched.error();
    }
    for (auto const& file : found_) {
        if (auto const may_go_on = ask(order_.interrupt); !may_go_on)
            return may_go_on.error();
        if (auto const placed = place(file); !placed)
            return placed.error();
    }
    return {};
}

result<> LfsFetch::fetch_some(std::size_t first, std::size_t count)
{
    FetchShare::Loan const loan(*order_.share);
    FetchBytes price;
    price.memory = memory_of_batch;
    if (auto const taken = order_.share->take(price); !taken)
        return taken.error();
    std::vector<core::LfsPointer> pointers;
    for (std::size_t i = first; i < first + count; ++i)
        pointers.push_back(found_[i].pointer);
    auto const downloads = ask_server(pointers);
    if (!downloads)
        return downloads.error();
    // A few threads share the batch, this one among them.
    next_ = 0;
    std::vector<std::thread> others;
    auto const work = [&] { receive_in_turn(*downloads, first); };
    try {
        while (others.size() + 1 < std::min(downloads_at_once, count))
            others.emplace_back(work);
    } catch (std::system_error const&) {
        // It goes with fewer, too.
    }
    work();
    for (auto& other : others)
        other.join();
    return outcome_;
}

/// Gets the download addresses of the objects, by the batch API.
result<std::vector<core::LfsDownload>> LfsFetch::ask_server(std::vector<core::LfsPointer> const& pointers)
{
    bool const all_empty =
        std::all_of(pointers.begin(), pointers.end(), [](auto const& each) { return each.size == 0; });
    if (all_empty)
        return std::vector<core::LfsDownload>(pointers.size());
    std::string answer;
    CurlRequest request;
    request.peer = "the LFS server";
    request.base = order_.forge;
    request.url = concat(order_.url, "/info/lfs/objects/batch");
    request.agent = "git-lfs/webots_cloud";
    request.headers = {concat("Accept: ", media_type), concat("Content-Type: ", media_type)};
    request.body = core::lfs_batch_request(pointers);
    request.sink = [&answer](std::string_view bytes) -> result<> {
        answer += bytes;
        return {};
    };
    request.explain = [this](Failure const& failure) { return problems_.explain(failure); };
    request.answered_by = &home_;
    auto limits = order_.limits;
    limits.bytes = core::max_lfs_answer;
    auto const status = http_.send(request, limits);
    if (!status)
        return status.error();
    if (*status != 200)
        return problems_.about_batch(*status);
    auto downloads = core::parse_lfs_batch(answer, pointers);
    if (!downloads)
        return problems_.explain(downloads.error().within("the LFS server"));
    return downloads;
}

/// Any number of threads may work on it.
void LfsFetch::receive_in_turn(std::vector<core::LfsDownload> const& downloads, std::size_t first)
{
    for (auto i = next_.fetch_add(1); i < downloads.size(); i = next_.fetch_add(1)) {
        auto const received = receive(found_[first + i], downloads[i]);
        if (received)
            continue;
        next_ = downloads.size();
        std::lock_guard const lock(mutex_);
        if (!abandoned_.exchange(true))
            outcome_ = received; // later ones may only be cut short by it
        return;
    }
}

result<> LfsFetch::receive(LargeFile const& file, core::LfsDownload const& from)
{
    auto const& pointer = file.pointer;
    FileDescriptor const to(::openat(scratch_, name_of(pointer).c_str(),
                                     O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (!to)
        return disk_failure();
    // The digest of no bytes at all: no server is needed.
    if (pointer.size == 0 && pointer.object == core::empty_lfs_object)
        return {};
    if (from.address.empty())
        return problems_.about_object(path_of(file), from.error, from.words);
    if (auto const allowed = may_ask(from.address); !allowed)
        return problems_.explain(allowed.error());
    Sha256 digest;
    std::uint64_t size = 0;
    auto const wrong = [&] { return problems_.about_content(path_of(file)); };
    CurlRequest request;
    request.peer = "the LFS server";
    request.base = core::base_of(from.address);
    request.url = from.address;
    request.agent = "git-lfs/webots_cloud";
    request.headers = from.headers;
    // A password for another host is none of the forge's: nobody knows whose.
    if (core::host_of_lfs_address(from.address) != core::host_of_lfs_address(order_.forge))
        std::erase_if(request.headers, [](std::string const& header) {
            return core::lower_case(header).starts_with("authorization:");
        });
    request.sink = [&](std::string_view bytes) -> result<> {
        size += bytes.size();
        if (size > pointer.size)
            return wrong();
        digest.update(bytes);
        report(bytes.size());
        return write_all(to.get(), bytes);
    };
    request.may_redirect = [&](std::string const& url) { return may_ask(url); };
    // A name that may be asked can still lead to an address of this network, unless it is the forge's own.
    request.may_contact = [&](std::string const& url, core::IpAddress const& address) {
        return core::base_of(url) == core::base_of(order_.forge) || address == home_ ||
               core::is_public_address(address);
    };
    request.explain = [this](Failure const& failure) { return problems_.explain(failure); };
    auto limits = order_.limits;
    limits.abandoned = &abandoned_;
    limits.bytes = pointer.size + memory_of_file; // the sink is stricter, and has better words
    auto const status = http_.send(request, limits);
    if (!status)
        return status.error();
    if (*status != 200)
        return problems_.about_object(path_of(file), *status, {});
    return size == pointer.size && digest.finish() == pointer.object ? result<>() : wrong();
}

/// Behind a proxy the name alone says who is reached: there it has to mean what may be contacted. (Should the
/// proxy know another meaning, TLS still asks for a certificate of the name.)
result<> LfsFetch::may_ask(std::string const& url)
{
    if (auto const allowed = core::check_lfs_address(url, order_.forge); !allowed)
        return allowed;
    if (core::base_of(url) == core::base_of(order_.forge) || !has_proxy())
        return {};
    std::lock_guard const lock(hosts_mutex_); // of several that ask for a host, one looks it up
    auto const host = core::host_of_lfs_address(url);
    if (auto const known = hosts_.find(host); known != hosts_.end())
        return known->second;
    if (hosts_.size() >= max_hosts)
        return Failure(errc::refused, "leads to too many hosts");
    return hosts_.emplace(host, may_mean(host)).first->second;
}

result<> LfsFetch::may_mean(std::string const& host)
{
    auto const theirs = addresses_of(host);
    if (theirs.empty())
        return Failure(errc::refused, concat("leads to ", core::printable(host, 100),
                                             ", a name that this machine can't look up"));
    auto const homes = addresses_of(core::host_of_lfs_address(order_.forge));
    for (auto const& address : theirs)
        if (!core::is_public_address(address) &&
            std::find(homes.begin(), homes.end(), address) == homes.end())
            return Failure(errc::refused, concat("leads to ", address.text()));
    return {};
}

void LfsFetch::report(std::uint64_t more)
{
    std::lock_guard const lock(mutex_);
    received_ += more;
    if (order_.progress)
        order_.progress->report_large_files(total_, received_);
}

/// The first file gets the content itself, others a link to it where that is all the same.
result<> LfsFetch::place(LargeFile const& file)
{
    auto const name = name_of(file.pointer);
    auto const& first = index_.entries[file.entries.front()];
    FolderWalk walk(files_);
    auto const home = walk.parent_of(first.path);
    if (!home)
        return home.error();
    if (::fchmodat(scratch_, name.c_str(), mode_of(first.kind), 0) != 0 ||
        ::renameat(scratch_, name.c_str(), *home, file_name(first.path)) != 0)
        return disk_failure();
    FolderWalk targets(files_);
    for (auto number = file.entries.begin() + 1; number != file.entries.end(); ++number) {
        auto const& entry = index_.entries[*number];
        auto const folder = targets.parent_of(entry.path);
        if (!folder)
            return folder.error();
        if (::unlinkat(*folder, file_name(entry.path), 0) != 0)
            return disk_failure();
        if (entry.kind == first.kind &&
            ::linkat(*home, file_name(first.path), *folder, file_name(entry.path), 0) == 0)
            continue;
        auto const copied = copy_file(*home, file_name(first.path), *folder, file_name(entry.path),
                                      entry.size, mode_of(entry.kind));
        if (!copied)
            return copied.error();
    }
    return {};
}

GitLargeFiles::GitLargeFiles(CurlHttp& http, LfsOrder order, GitIndex& index, int files, int scratch)
    : fetch_(std::make_unique<LfsFetch>(http, std::move(order), index, files, scratch))
{}

GitLargeFiles::~GitLargeFiles() = default;

result<bool> GitLargeFiles::find()
{
    if (auto const found = fetch_->find_pointers(); !found)
        return found.error();
    return !fetch_->empty();
}

result<> GitLargeFiles::fetch()
{
    auto const paid = fetch_->pay();
    return paid ? fetch_->fetch_all() : paid;
}

} // namespace webots_cloud::adapters
