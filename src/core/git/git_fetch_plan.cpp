// A small state machine without input or output: each outcome of a step leads to the next step or to the end.
// Servers differ in protocol version and filters, and fail in many ways, so each path is tested as a list of
// outcomes. git_fetch.cpp carries it out.
#include "git_fetch_plan.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"
#include "git_history.hpp"

#include <boost/system/errc.hpp>

#include <algorithm>
#include <cassert>

namespace webots_cloud::core {
namespace {

using namespace git_action;
using namespace git_outcome;

bool is_disk_full(Failure const& failure)
{
    return failure.code() == boost::system::errc::no_space_on_device;
}

/// The server does not answer the question, or not in full: it may answer a smaller one.
bool is_declined(Failure const& failure)
{
    return fails_as(failure, errc::too_large) || fails_as(failure, errc::protocol_error);
}

bool is_about_filters(Failure const& failure)
{
    return failure == GitProblem::filter_not_supported || failure == GitProblem::no_single_files;
}

/// Some servers send only commits, whatever they announce.
Failed about_files(Failed const& failed)
{
    if (failed.failure != GitProblem::object_not_advertised)
        return failed;
    return {Failure(GitProblem::no_single_files, "the git server does not hand out single files"),
            failed.pack_begun};
}

} // namespace

std::string GitFetchPlan::ref() const
{
    std::string_view ref = project_.ref_and_folder;
    if (!target_.folder.empty())
        ref.remove_suffix(target_.folder.size() + 1);
    return ref == "HEAD" ? default_branch_ : std::string(ref);
}

GitAction GitFetchPlan::go(Step step, GitAction action)
{
    step_ = step;
    return action;
}

GitAction GitFetchPlan::fail(Failure const& failure)
{
    return go(Step::over, Fail{explain(failure, project_)});
}

GitAction GitFetchPlan::fail_commit(Refused why)
{
    constexpr std::size_t digits = 12;
    return fail(refused(why, {{"commit", to_hex(target_.commit).substr(0, digits)},
                              {"name", concat(project_.owner, "/", project_.repository)}}));
}

GitAction GitFetchPlan::next(GitOutcome const& outcome)
{
    assert(step_ != Step::over);
    auto const* const failed = std::get_if<Failed>(&outcome);
    bool const hit = std::holds_alternative<CacheHit>(outcome);
    // Steps of which a failure is just one of the outcomes.
    switch (step_) {
    case Step::find_commit:
        return hit ? find_folder() : list_refs();
    case Step::list_refs:
        return after_refs(outcome);
    case Step::ask_after_refs:
        return after_capabilities_for_refs(outcome);
    case Step::remember_before_refs:
        return list_refs();
    case Step::remember_missing:
        return look_up_failed(failure_);
    case Step::forget_target:
        return fail(failure_);
    case Step::find_folder:
        return hit ? go(Step::over, Succeed{}) : go(Step::wait_for_turn, WaitForTurn{});
    case Step::find_last_folder:
        return hit ? go(Step::over, Succeed{explain_use_of_cache(failure_, project_)}) : fail(failure_);
    case Step::wait_for_turn:
        if (auto const* const turn = std::get_if<Turn>(&outcome))
            known_ = turn->known;
        capabilities_ = known_.value_or(GitCapabilities());
        return begin_download();
    case Step::fetch_history:
        return after_history(outcome);
    case Step::fetch_files:
        return after_files(outcome);
    case Step::make_room:
        return failed ? fail(failure_) : begin_download();
    case Step::ask_after_download:
        return after_capabilities_for_download(outcome);
    case Step::remember_before_download:
        return begin_download();
    case Step::remember_after_download:
        return go(Step::over, Succeed{});
    default:
        break;
    }
    // From here on, a failure ends the download, or has it tried in another way.
    if (failed)
        return download_failed(*failed);
    switch (step_) {
    case Step::begin_download:
        return after_begin(outcome);
    case Step::search_history:
        return after_search(outcome);
    case Step::fetch_commit:
        return go(Step::lay_out, LayOut{target_});
    case Step::lay_out:
        return after_layout(outcome);
    case Step::unpack:
        return go(Step::find_large_files, FindLargeFiles{});
    case Step::find_large_files:
        return std::holds_alternative<PointersFound>(outcome) ? go(Step::fetch_large_files, FetchLargeFiles{})
                                                              : go(Step::publish, Publish{});
    case Step::fetch_large_files:
        return go(Step::publish, Publish{});
    default:
        break;
    }
    // Published, or the worlds have been read.
    return asked_again_ ? go(Step::remember_after_download, RememberCapabilities{capabilities_})
                        : go(Step::over, Succeed{});
}

// ---- what the address means ------------------------------------------------------------------------------

GitAction GitFetchPlan::start(GitServerFacts const& facts)
{
    known_ = facts.known;
    if (facts.is_missing)
        return fail(Failure(GitProblem::no_such_repository));
    if (!names_commit(project_.ref_and_folder))
        return list_refs();
    auto target = resolve_ref(project_.ref_and_folder, {});
    if (!target)
        return fail(target.error());
    target_ = std::move(*target);
    return go(Step::find_commit, FindCommit{target_.commit});
}

GitAction GitFetchPlan::list_refs()
{
    ListRefs action;
    action.version_2 = !known_ || known_->version_2;
    auto const& wanted = project_.ref_and_folder;
    action.prefixes = names_commit(wanted) ? all_ref_prefixes() : ref_prefixes(wanted);
    return go(Step::list_refs, std::move(action));
}

/// A server sends whatever is in its store, and forges keep forks and pull requests there too. The
/// repository's own is what its branches and tags lead to; of what is in the cache that is known. To search
/// a history takes long: that is left to the download.
GitAction GitFetchPlan::after_refs(GitOutcome const& outcome)
{
    if (auto const* const failed = std::get_if<Failed>(&outcome))
        return after_failed_refs(failed->failure);
    auto const* const received = std::get_if<RefsReceived>(&outcome);
    auto const refs = received ? received->refs : std::vector<GitRef>();
    auto target = resolve_ref(project_.ref_and_folder, refs);
    if (!target)
        return look_up_failed(target.error());
    target_ = std::move(*target);
    default_branch_ = default_branch(refs);
    if (names_commit(project_.ref_and_folder)) {
        tips_ = git_tips(refs);
        history_unknown_ = std::find(tips_.begin(), tips_.end(), target_.commit) == tips_.end();
    }
    return find_folder();
}

/// A server without version 2 does not understand the request for refs, and for one that only serves files
/// its address does not exist.
GitAction GitFetchPlan::after_failed_refs(Failure const& failure)
{
    failure_ = failure;
    bool const is_missing = failure == GitProblem::no_such_repository;
    bool const asked_by_libgit2 = known_ && !known_->version_2;
    if (asked_by_libgit2)
        return is_missing ? go(Step::remember_missing, RememberMissing{}) : look_up_failed(failure);
    bool const may_be_old = fails_as(failure, errc::protocol_error) && !known_;
    return may_be_old || is_missing ? go(Step::ask_after_refs, AskCapabilities{}) : look_up_failed(failure);
}

GitAction GitFetchPlan::after_capabilities_for_refs(GitOutcome const& outcome)
{
    auto const* const received = std::get_if<CapabilitiesReceived>(&outcome);
    auto const* const failed = std::get_if<Failed>(&outcome);
    // An old server after all: it is asked again, in its own way.
    if (received && !received->capabilities.version_2) {
        known_ = received->capabilities;
        return go(Step::remember_before_refs, RememberCapabilities{*known_});
    }
    if (failed && failed->failure == GitProblem::unknown_format)
        return look_up_failed(failed->failure);
    if (failure_ != GitProblem::no_such_repository)
        return look_up_failed(failure_);
    if (failed && failed->failure != GitProblem::no_such_repository)
        return look_up_failed(failed->failure);
    // It says so to both questions. That is remembered, so that others who ask for it do not wait again.
    return go(Step::remember_missing, RememberMissing{});
}

GitAction GitFetchPlan::find_folder()
{
    return is_for_worlds() ? go(Step::wait_for_turn, WaitForTurn{})
                           : go(Step::find_folder, FindFolder{target_});
}

/// When the server can't be asked, what it said last is better than nothing.
GitAction GitFetchPlan::look_up_failed(Failure const& failure)
{
    failure_ = failure;
    if (fails_as(failure, errc::not_found))
        return go(Step::forget_target, ForgetTarget{});
    if (is_for_worlds())
        return fail(failure);
    if (fails_as(failure, errc::unreachable) || fails_as(failure, errc::timed_out) ||
        fails_as(failure, errc::protocol_error))
        return go(Step::find_last_folder, FindLastFolder{});
    return fail(failure);
}

// ---- the download ----------------------------------------------------------------------------------------

GitAction GitFetchPlan::begin_download()
{
    laid_out_ = false;
    files_ = GitFiles::all;
    parents_too_large_ = false;
    return go(Step::begin_download, BeginDownload{capabilities_});
}

/// Whose the commit is should be known before much of it travels: before its files do, or with them.
GitAction GitFetchPlan::after_begin(GitOutcome const& outcome)
{
    auto const* const begun = std::get_if<Begun>(&outcome);
    // Where much of what the commit has is not wanted, or is in the cache already, its files are asked for
    // one by one. Where all is new, that would only be a second request.
    bool const is_part = is_for_worlds() || !target_.folder.empty() || (begun && begun->has_donors);
    without_files_ = capabilities_.version_2 && capabilities_.filter && is_part;
    if (!history_unknown_)
        return fetch_commit();
    if (!capabilities_.version_2 || !capabilities_.filter)
        return fail_commit(Refused::commit_not_newest);
    if (tips_.size() > max_git_wants)
        return fail_commit(Refused::history_too_large);
    history_with_files_ = false;
    return without_files_ ? fetch_commit() : fetch_history();
}

GitAction GitFetchPlan::fetch_history()
{
    if (tips_.empty() && !history_with_files_)
        return go(Step::search_history, SearchHistory{tips_});
    return go(Step::fetch_history, FetchHistory{tips_, history_with_files_});
}

/// Servers that do not send both together may send one after the other.
GitAction GitFetchPlan::after_history(GitOutcome const& outcome)
{
    auto const* const failed = std::get_if<Failed>(&outcome);
    auto const* const stopped = std::get_if<ParentFilesStopped>(&outcome);
    if (stopped) {
        files_ = GitFiles::of_project;
        parents_too_large_ = stopped->too_large;
    }
    if (!failed && !stopped)
        return go(Step::search_history, SearchHistory{tips_});
    if (failed && !is_declined(failed->failure))
        return download_failed(Failed(failed->failure)); // which capabilities it has is not the question
    if (history_with_files_) {
        history_with_files_ = false;
        return fetch_history();
    }
    bool const is_too_large = stopped || fails_as(failed->failure, errc::too_large);
    return fail_commit(is_too_large ? Refused::history_too_large : Refused::commit_not_newest);
}

GitAction GitFetchPlan::after_search(GitOutcome const& outcome)
{
    if (!std::holds_alternative<InHistory>(outcome))
        return fail_commit(Refused::commit_on_no_branch);
    history_unknown_ = false;
    return laid_out_ ? fetch_files() : fetch_commit();
}

GitAction GitFetchPlan::fetch_commit()
{
    FetchCommit action;
    action.commit = target_.commit;
    action.shallow = capabilities_.shallow;
    action.without_files = without_files_;
    return go(Step::fetch_commit, action);
}

GitAction GitFetchPlan::after_layout(GitOutcome const& outcome)
{
    laid_out_ = true;
    auto const* const layout = std::get_if<LaidOut>(&outcome);
    auto const missing = layout ? layout->files_missing : 0;
    if (!history_unknown_)
        return fetch_files();
    // One request for both, where that is not too long.
    history_with_files_ = missing > 0 && tips_.size() + missing <= max_git_wants;
    return fetch_history();
}

GitAction GitFetchPlan::fetch_files()
{
    if (!capabilities_.version_2) // all that it has to give is there
        return use_files();
    return go(Step::fetch_files, FetchFiles{files_});
}

GitAction GitFetchPlan::use_files()
{
    return is_for_worlds() ? go(Step::read_worlds, ReadWorlds{}) : go(Step::unpack, Unpack{});
}

/// The files of the folders above the project come with the others, and the transfer is cut when they turn
/// out to be too large, or may be.
GitAction GitFetchPlan::after_files(GitOutcome const& outcome)
{
    if (is_for_worlds()) // also those that did not come, which are listed without a title
        return use_files();
    if (auto const* const failed = std::get_if<Failed>(&outcome))
        return download_failed(about_files(*failed));
    auto const* const stopped = std::get_if<ParentFilesStopped>(&outcome);
    if (stopped && files_ == GitFiles::all) {
        files_ = GitFiles::of_project;
        parents_too_large_ = stopped->too_large;
        return fetch_files();
    }
    if (files_ == GitFiles::of_project && !parents_too_large_) {
        // A large file had come: it was the project's own, or it comes again.
        files_ = GitFiles::all_after_project;
        return fetch_files();
    }
    return use_files();
}

GitAction GitFetchPlan::download_failed(Failed const& failed)
{
    failure_ = failed.failure;
    if (is_disk_full(failure_) && !room_made_) {
        room_made_ = true;
        return go(Step::make_room, MakeRoom{});
    }
    // Only a server that has not understood the request for a pack is asked what it can do.
    bool const asked_for_pack = step_ == Step::fetch_commit || step_ == Step::fetch_files;
    bool const is_understood =
        !asked_for_pack || failed.pack_begun || !fails_as(failure_, errc::protocol_error);
    if (is_understood || failure_ == GitProblem::object_not_advertised || known_ || asked_again_)
        return fail(failure_);
    return go(Step::ask_after_download, AskCapabilities{});
}

GitAction GitFetchPlan::after_capabilities_for_download(GitOutcome const& outcome)
{
    if (auto const* const failed = std::get_if<Failed>(&outcome))
        return fail(failed->failure);
    auto const* const received = std::get_if<CapabilitiesReceived>(&outcome);
    auto offered = received ? received->capabilities : GitCapabilities();
    if (offered == GitCapabilities()) {
        if (!is_about_filters(failure_))
            return fail(failure_); // it can do what was asked: something else is wrong
        offered.filter = false;    // it promises more than it keeps
    }
    capabilities_ = offered;
    asked_again_ = true;
    room_made_ = false;
    return offered.version_2 ? begin_download()
                             : go(Step::remember_before_download, RememberCapabilities{capabilities_});
}

} // namespace webots_cloud::core
