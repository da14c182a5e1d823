// How a folder of a repository is fetched: which step follows from what became of the one before.
#pragma once

#include "core/refusals.hpp"
#include "git_object_id.hpp"
#include "git_problem.hpp"
#include "git_refs.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/project_ref.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace webots_cloud::core {

/// A server's optional capabilities.
struct GitCapabilities
{
    bool version_2 = true; ///< Of the protocol; without it, libgit2 is used.
    bool shallow = true;   ///< One commit without its history.
    bool filter = true;    ///< Without files; and objects by name.

    bool operator==(GitCapabilities const&) const = default;
};

/// What may be requested at once: half a megabyte, as proxies limit the size of requests.
constexpr std::size_t max_git_wants = 10'000;

/// Which files a transfer is for.
enum class GitFiles
{
    all,               ///< The project's, and those of the folders above it.
    of_project,        ///< Those of the folders above it were too large, or may be.
    all_after_project, ///< The project's are there; the others get a second chance.
};

/// What a fetch is for.
enum class GitPurpose
{
    folder, ///< A project, in the cache.
    worlds  ///< A list of the worlds in a folder, of which nothing is kept.
};

/// What is to be done next. Each has the outcomes that its comment names, and `Failed`; where none is named,
/// `Done`.
namespace git_action {

/// Whether the cache has a folder of this commit: `CacheHit`, `CacheMiss`.
struct FindCommit
{
    GitObjectId commit;
};

/// Ask the server for the refs that begin with `prefixes`: `RefsReceived`.
struct ListRefs
{
    bool version_2 = true;
    std::vector<std::string> prefixes;
};

/// Ask the server what it can do: `CapabilitiesReceived`.
struct AskCapabilities
{};

/// Note for later fetches what the server can do.
struct RememberCapabilities
{
    GitCapabilities capabilities;
};

/// Note for later fetches that the repository does not exist.
struct RememberMissing
{};

/// Remove from the cache what the address meant last.
struct ForgetTarget
{};

/// Look for the target in the cache: `CacheHit`, `CacheMiss`.
struct FindFolder
{
    GitTarget target;
};

/// Look in the cache for what the address meant last: `CacheHit`, `CacheMiss`.
struct FindLastFolder
{};

/// Wait until it is this fetch's turn to download: `Turn`.
struct WaitForTurn
{};

/// Make a place for what will arrive, and look for files that older folders have already: `Begun`.
struct BeginDownload
{
    GitCapabilities capabilities; ///< What the server is believed to be able to do.
};

/// Fetch all commits that the tips lead to, without their folders: `PackReceived`, `ParentFilesStopped`.
struct FetchHistory
{
    std::vector<GitObjectId> tips;
    bool with_files = false; ///< And the files that the layout lacks: a round trip saved.
};

/// Whether these tips lead to the commit: `InHistory`, `NotInHistory`.
struct SearchHistory
{
    std::vector<GitObjectId> tips;
};

/// Fetch the commit and its folders: `PackReceived`.
struct FetchCommit
{
    GitObjectId commit;
    bool shallow = false;       ///< Without its history.
    bool without_files = false; ///< These follow by name.
};

/// Find the folder in the commit, and decide what it becomes on disk: `LaidOut`.
struct LayOut
{
    GitTarget target;
};

/// Fetch the files that the layout lacks: `PackReceived`, `ParentFilesStopped`.
struct FetchFiles
{
    GitFiles files = GitFiles::all;
};

/// Read what the worlds of the folder say of themselves, as far as they are there.
struct ReadWorlds
{};

/// Put all files in their places.
struct Unpack
{};

/// Look for pointers to large files (Git LFS): `PointersFound`, `Done`.
struct FindLargeFiles
{};

/// Put the content of large files where pointers to them are.
struct FetchLargeFiles
{};

/// Put the folder into the cache.
struct Publish
{};

/// Remove from the cache what nobody uses; `Failed`, if there was nothing.
struct MakeRoom
{};

/// The end: the folder is in the cache.
struct Succeed
{
    std::string notice; ///< Not empty: it is what the address meant last, for this reason.
};

/// The end: a sentence for the person who asked for the project.
struct Fail
{
    Failure failure;
};

} // namespace git_action

using GitAction =
    std::variant<git_action::FindCommit, git_action::ListRefs, git_action::AskCapabilities,
                 git_action::RememberCapabilities, git_action::RememberMissing, git_action::ForgetTarget,
                 git_action::FindFolder, git_action::FindLastFolder, git_action::WaitForTurn,
                 git_action::BeginDownload, git_action::FetchHistory, git_action::SearchHistory,
                 git_action::FetchCommit, git_action::LayOut, git_action::FetchFiles, git_action::ReadWorlds,
                 git_action::Unpack, git_action::FindLargeFiles, git_action::FetchLargeFiles,
                 git_action::Publish, git_action::MakeRoom, git_action::Succeed, git_action::Fail>;

/// What became of an action.
namespace git_outcome {

struct Done
{};

/// It has failed, for a `GitProblem` or another reason.
struct Failed
{
    Failed(Failure why, bool pack_had_begun = true) : failure(std::move(why)), pack_begun(pack_had_begun) {}

    Failure failure;
    bool pack_begun; ///< The server understood the request, if it was one for a pack.
};

struct CacheHit
{};

struct CacheMiss
{};

struct RefsReceived
{
    std::vector<GitRef> refs;
};

struct CapabilitiesReceived
{
    GitCapabilities capabilities;
};

struct Turn
{
    std::optional<GitCapabilities> known; ///< As in `GitServerFacts`.
};

struct Begun
{
    bool has_donors = false; ///< Other folders of the repository are in the cache.
};

struct PackReceived
{};

/// The transfer was cut for the files of the folders above the project.
struct ParentFilesStopped
{
    bool too_large = false; ///< They certainly are; else a file came that might have been one of them.
};

struct InHistory
{};

struct NotInHistory
{};

struct LaidOut
{
    std::size_t files_missing = 0;
};

struct PointersFound
{};

} // namespace git_outcome

using GitOutcome =
    std::variant<git_outcome::Done, git_outcome::Failed, git_outcome::CacheHit, git_outcome::CacheMiss,
                 git_outcome::RefsReceived, git_outcome::CapabilitiesReceived, git_outcome::Turn,
                 git_outcome::Begun, git_outcome::PackReceived, git_outcome::ParentFilesStopped,
                 git_outcome::InHistory, git_outcome::NotInHistory, git_outcome::LaidOut,
                 git_outcome::PointersFound>;

/// What earlier fetches have found out.
struct GitServerFacts
{
    bool is_missing = false;              ///< The repository did not exist a moment ago.
    std::optional<GitCapabilities> known; ///< Nothing: it never failed, and is believed to have all of them.
};

/// A state machine without I/O: its owner carries each action out and reports the outcome.
///
/// It tries what git servers usually can do, and asks what this one can only after a failure: one round trip
/// when the commit is known, two for a whole repository, three for a folder of one or for a commit that is
/// requested by its hash. It ends after a bounded number of actions, whatever the outcomes are.
class GitFetchPlan
{
public:
    explicit GitFetchPlan(ProjectRef project, GitPurpose purpose = GitPurpose::folder)
        : project_(std::move(project)), purpose_(purpose)
    {}

    /// The first action.
    GitAction start(GitServerFacts const& facts);

    /// What follows from the outcome of the last action.   Precondition: that was not the end.
    GitAction next(GitOutcome const& outcome);

    /// Once the server, or the cache, has said what the address means.
    GitTarget const& target() const noexcept { return target_; }

    /// The ref of the address; of `HEAD` the branch that it stands for, once the server has said that.
    std::string ref() const;

private:
    /// Which action's outcome comes next; an action with two purposes has two steps.
    enum class Step
    {
        find_commit,
        list_refs,
        ask_after_refs,
        remember_before_refs,
        remember_missing,
        forget_target,
        find_folder,
        find_last_folder,
        wait_for_turn,
        begin_download,
        fetch_history,
        search_history,
        fetch_commit,
        lay_out,
        fetch_files,
        read_worlds,
        unpack,
        find_large_files,
        fetch_large_files,
        publish,
        make_room,
        ask_after_download,
        remember_before_download,
        remember_after_download,
        over
    };

    GitAction go(Step step, GitAction action);
    GitAction fail(Failure const& failure);
    GitAction fail_commit(Refused why);
    GitAction look_up_failed(Failure const& failure);
    GitAction download_failed(git_outcome::Failed const& failed);

    GitAction list_refs();
    GitAction find_folder();
    GitAction begin_download();
    GitAction fetch_history();
    GitAction fetch_commit();
    GitAction fetch_files();
    GitAction use_files();

    GitAction after_refs(GitOutcome const& outcome);
    GitAction after_failed_refs(Failure const& failure);
    GitAction after_capabilities_for_refs(GitOutcome const& outcome);
    GitAction after_capabilities_for_download(GitOutcome const& outcome);
    GitAction after_begin(GitOutcome const& outcome);
    GitAction after_history(GitOutcome const& outcome);
    GitAction after_search(GitOutcome const& outcome);
    GitAction after_layout(GitOutcome const& outcome);
    GitAction after_files(GitOutcome const& outcome);

    bool is_for_worlds() const noexcept { return purpose_ == GitPurpose::worlds; }

    ProjectRef project_;
    GitPurpose purpose_;
    std::string default_branch_ = "HEAD";
    Step step_ = Step::over;
    GitTarget target_;
    Failure failure_;                      ///< The reason for the last question or clean-up.
    std::optional<GitCapabilities> known_; ///< Of the server.
    GitCapabilities capabilities_;         ///< What this download makes use of.
    std::vector<GitObjectId> tips_;        ///< Those that may lead to the commit,
    bool history_unknown_ = false;         ///< while that is not known.
    bool without_files_ = false;           ///< The commit comes without them.
    bool laid_out_ = false;
    bool history_with_files_ = false;
    GitFiles files_ = GitFiles::all;
    bool parents_too_large_ = false;
    bool room_made_ = false;
    bool asked_again_ = false; ///< This download makes use of what the server itself has said.
};

} // namespace webots_cloud::core
