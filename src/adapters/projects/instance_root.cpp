// Opens the folder for running simulations, perhaps after a crash, in a place where others may write: no link
// is followed, what is in the way gets another name, and the reason is told.
#include "instance_root.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "adapters/files/own_folder.hpp"
#include "adapters/files/remove_tree.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/secrets.hpp>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud::adapters {
namespace fs = std::filesystem;

using core::concat;

namespace {

constexpr std::string_view purpose = ", for the directories of simulations: ";
constexpr std::string_view elsewhere = " or set \"stateDir\" to another folder.";

Failure refusal(fs::path const& folder, std::string_view why)
{
    return Failure(errc::invalid_argument, concat(folder.string(), purpose, why));
}

/// What may be otherwise at the next attempt.
Failure system_refusal(fs::path const& folder)
{
    boost::system::error_code const error(errno, boost::system::system_category());
    return {error, concat(folder.string(), purpose, error.message())};
}

/// Whether all users may rename and remove what is in a folder, whoever owns that.
bool everybody_may_rename(struct stat const& status) noexcept
{
    return (status.st_mode & S_IWOTH) != 0 && (status.st_mode & S_ISVTX) == 0;
}

Failure refusal_to_share(fs::path const& folder)
{
    return refusal(
        folder, concat("everybody may rename what is in it. Give it the sticky bit (chmod +t),", elsewhere));
}

/// Makes the folder where it is missing and opens it; `status` is what it is then.
result<FileDescriptor> make_and_open(fs::path const& folder, struct stat& status)
{
    std::error_code failed; // opening it says why
    fs::create_directories(folder, failed);
    FileDescriptor opened(::open(folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
    if (!opened || ::fstat(opened.get(), &status) != 0)
        return system_refusal(folder);
    return opened;
}

/// The folder that ours are in: the operator's choice, and perhaps everybody's.
result<FileDescriptor> open_shared(fs::path const& folder)
{
    struct stat status;
    auto opened = make_and_open(folder, status);
    if (!opened)
        return opened.error();
    if (everybody_may_rename(status))
        return refusal_to_share(folder);
    return opened;
}

/// A folder that was chosen by somebody who may have put a link there.
result<FileDescriptor> open_chosen(fs::path const& folder, std::vector<std::string>& notices)
{
    struct stat status;
    auto found = make_and_open(folder, status);
    if (!found)
        return found.error();
    auto const is_ours = status.st_uid == ::geteuid();
    if (!is_ours && status.st_uid != 0)
        return refusal(
            folder,
            concat("it belongs to another user. Give it to the user of this server (chown),", elsewhere));
    bool const others_write = (status.st_mode & (S_IWGRP | S_IWOTH)) != 0;
    bool const we_can = (status.st_mode & S_IRWXU) == S_IRWXU;
    if (is_ours && (others_write || !we_can)) {
        auto const link = concat("/proc/self/fd/", std::to_string(found->get()));
        if (::chmod(link.c_str(), ((status.st_mode | S_IRWXU) & 07777) & ~mode_t(S_IWGRP | S_IWOTH)) != 0)
            return system_refusal(folder);
        notices.push_back(concat(folder.string(), " had the mode of a folder that ",
                                 we_can ? "others may write to" : "we can't use", ": that is mended."));
    } else if (everybody_may_rename(status)) {
        return refusal_to_share(folder);
    }
    return found;
}

/// The folder that was asked for, which holds those of all our ports.
result<FileDescriptor> open_state(fs::path const& folder, InstanceRoot::State link,
                                  std::vector<std::string>& notices)
{
    if (link == InstanceRoot::State::may_be_link)
        return open_chosen(folder, notices);
    auto const parent = open_shared(folder.parent_path());
    if (!parent)
        return parent.error();
    auto own = open_own_folder(parent->get(), folder, Foreign::refuse, notices);
    if (!own && own.error() == errc::invalid_argument)
        return refusal(folder, concat("it belongs to another user. Remove it,", elsewhere));
    return own;
}

constexpr std::string_view aside = "left-over-";

/// Empties `folder`, wherever its name may lead by now. What can't be removed gets a name that is no
/// simulation's.
result<LeftOvers> clear(int opened, fs::path const& folder)
{
    LeftOvers left_overs;
    std::error_code failed;
    auto const entries = fs::path("/proc/self/fd") / std::to_string(opened);
    for (auto const& entry : fs::directory_iterator(entries, failed)) {
        auto const outcome = remove_tree(entry.path()); // which may have an overlay mounted
        if (outcome) {
            ++left_overs.removed;
            continue;
        }
        auto const name = entry.path().filename().string();
        auto const other = concat(aside, make_token().substr(0, 8));
        if (!name.starts_with(aside) && ::renameat(opened, name.c_str(), opened, other.c_str()) != 0)
            return Failure(make_error_code(boost::system::errc::io_error),
                           concat(folder.string(), purpose, "can't remove the left-over ", name, ": ",
                                  outcome.error().message()));
        ++left_overs.kept;
    }
    if (failed)
        return Failure(boost::system::error_code(failed), concat(folder.string(), purpose, failed.message()));
    return left_overs;
}

} // namespace

result<InstanceRoot> InstanceRoot::open(fs::path const& state, std::string const& name, State link)
{
    InstanceRoot root;
    auto const outer = open_state(state, link, root.notices_);
    if (!outer)
        return outer.error();
    auto const own = open_own_folder(outer->get(), state / name, Foreign::set_aside, root.notices_);
    if (!own)
        return own.error();
    root.path_ = state / name / "instances";
    auto taken = open_own_folder(own->get(), root.path_, Foreign::set_aside, root.notices_);
    if (!taken)
        return taken.error();
    root.brokers_ = state / name / "brokers";
    auto const brokers = open_own_folder(own->get(), root.brokers_, Foreign::set_aside, root.notices_);
    if (!brokers)
        return brokers.error();
    // Locked before anything is removed: what a running server has in it is no left-over.
    if (::flock(taken->get(), LOCK_EX | LOCK_NB) != 0)
        return Failure(boost::system::error_code(errno, boost::system::system_category()),
                       concat(root.path_.string(), purpose,
                              "another simulation server uses it; is one running already?"));
    auto const left_overs = clear(taken->get(), root.path_);
    if (!left_overs)
        return left_overs.error();
    root.lock_ = taken->release();
    root.left_overs_ = *left_overs;
    return root;
}

void InstanceRoot::remove_left_overs()
{
    auto const tried = clear(lock_, path_);
    left_overs_.removed += tried ? tried->removed : 0;
    left_overs_.kept = tried ? tried->kept : left_overs_.kept;
}

InstanceRoot::~InstanceRoot()
{
    if (lock_ >= 0)
        ::close(lock_);
}

} // namespace webots_cloud::adapters
