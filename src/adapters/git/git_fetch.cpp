// Carries out the steps of core/git/git_fetch_plan, which decides what follows from what; here are the
// requests, files and limits of each step.
#include "git_fetch.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"

#include <algorithm>
#include <type_traits>
#include <variant>

namespace webots_cloud::adapters {
namespace {

using namespace core::git_action;
using namespace core::git_outcome;
using core::GitAction;
using core::GitFiles;
using core::GitOutcome;
using core::GitProblem;

constexpr std::uint64_t memory_of_refs = std::uint64_t{16} << 20; // of 8 MB that a server may list

std::function<void(bool)> teller_of(GitProgress* progress)
{
    return [progress](bool waits) {
        if (progress)
            progress->report_waiting(waits);
    };
}

/// Actions after which somebody else goes on.
template<class Action>
constexpr bool is_stop =
    std::is_same_v<Action, WaitForTurn> || std::is_same_v<Action, Succeed> || std::is_same_v<Action, Fail>;

GitRemote remote_of(ProjectRef const& project)
{
    GitRemote remote;
    remote.base = project.forge;
    remote.url = project.clone_url();
    return remote;
}

GitOutcome hit_or_miss(bool hit)
{
    return hit ? GitOutcome(CacheHit()) : GitOutcome(CacheMiss());
}

GitOutcome outcome_of(result<> const& done)
{
    return done ? GitOutcome(Done()) : GitOutcome(Failed(done.error()));
}

} // namespace

GitFetch::GitFetch(CurlHttp& http, GitCache& cache, GitServers& servers, GitSourceConfig const& config,
                   std::shared_ptr<FetchBudget> budget, GitFetchOrder order)
    : http_(http), cache_(cache), servers_(servers), config_(config), order_(std::move(order)),
      url_(order_.project.clone_url()), plan_(order_.project, order_.purpose),
      peer_(http_, cache_, remote_of(order_.project)), deadline_(order_.aborted, order_.limits.timeout),
      share_(std::move(budget), deadline_.waiting(teller_of(order_.progress)))
{}

// ---- the plan ------------------------------------------------------------------------------------------

std::optional<result<GitFetched>> GitFetch::look_up()
{
    deadline_.restart();
    FetchShare::Loan const loan(share_);
    core::GitServerFacts facts;
    facts.is_missing = servers_.is_missing(url_);
    facts.known = servers_.capabilities(order_.project.forge);
    auto const action = run(plan_.start(facts));
    if (!std::holds_alternative<WaitForTurn>(action))
        return end(action);
    peer_.hang_up_if_large();
    return std::nullopt;
}

result<GitFetched> GitFetch::download()
{
    deadline_.restart();
    FetchShare::Loan const loan(share_);
    Turn turn;
    turn.known = servers_.capabilities(order_.project.forge);
    auto const action = run(plan_.next(turn));
    drop_download();
    peer_.hang_up();
    if (std::holds_alternative<Succeed>(action))
        cache_.trim();
    return end(action);
}

/// Until somebody else has to go on.
GitAction GitFetch::run(GitAction action)
{
    while (auto const outcome = carry_out(action))
        action = plan_.next(*outcome);
    return action;
}

std::optional<GitOutcome> GitFetch::carry_out(GitAction const& action)
{
    return std::visit(
        [this]<class Action>(Action const& each) -> std::optional<GitOutcome> {
            if constexpr (is_stop<Action>)
                return std::nullopt;
            else
                return this->carry_out(each);
        },
        action);
}

result<GitFetched> GitFetch::end(GitAction const& action)
{
    if (auto const* const failed = std::get_if<Fail>(&action))
        return failed->failure;
    GitFetched fetched;
    fetched.snapshot = std::move(snapshot_);
    fetched.worlds = std::move(worlds_);
    fetched.notice = std::get<Succeed>(action).notice;
    if (fetched.notice.empty() && !is_for_worlds())
        cache_.remember(url_, order_.project.ref_and_folder, plan_.target());
    return fetched;
}

// ---- what the address means ----------------------------------------------------------------------------

GitOutcome GitFetch::carry_out(FindCommit const& action)
{
    return hit_or_miss(cache_.knows(url_, action.commit));
}

GitOutcome GitFetch::carry_out(ListRefs const& action)
{
    FetchBytes price;
    price.memory = memory_of_refs;
    if (auto const taken = share_.take(price); !taken)
        return Failed(taken.error());
    auto limits = peer_limits(order_.limits.bytes);
    // A question that the cache could answer, if need be, does not wait as long as others.
    if (action.version_2 && cache_.recall(url_, order_.project.ref_and_folder))
        limits.http.deadline =
            std::min(limits.http.deadline, std::chrono::steady_clock::now() + config_.patience);
    auto refs = peer_.list_refs(action, limits);
    if (!refs)
        return Failed(refs.error());
    return RefsReceived{std::move(*refs)};
}

GitOutcome GitFetch::carry_out(AskCapabilities const&)
{
    auto const offered = peer_.capabilities(peer_limits(order_.limits.bytes));
    return offered ? GitOutcome(CapabilitiesReceived{*offered}) : GitOutcome(Failed(offered.error()));
}

GitOutcome GitFetch::carry_out(RememberCapabilities const& action)
{
    servers_.set_capabilities(order_.project.forge, action.capabilities);
    return Done();
}

GitOutcome GitFetch::carry_out(RememberMissing const&)
{
    servers_.set_missing(url_);
    return Done();
}

GitOutcome GitFetch::carry_out(ForgetTarget const&)
{
    cache_.forget(url_, order_.project.ref_and_folder);
    return Done();
}

GitOutcome GitFetch::carry_out(FindFolder const& action)
{
    snapshot_ = cache_.find(url_, action.target, order_.aborted);
    return hit_or_miss(snapshot_ != nullptr);
}

GitOutcome GitFetch::carry_out(FindLastFolder const&)
{
    if (auto const target = cache_.recall(url_, order_.project.ref_and_folder))
        snapshot_ = cache_.find(url_, *target, order_.aborted);
    return hit_or_miss(snapshot_ != nullptr);
}

// ---- the download --------------------------------------------------------------------------------------

GitOutcome GitFetch::carry_out(BeginDownload const& action)
{
    drop_download(); // gives back what it had before another one takes it
    capabilities_ = action.capabilities;
    files_wanted_ = files_read_ = 0;
    GitDownloadOrder order;
    order.project = order_.project;
    order.limits = order_.limits;
    order.interrupt = deadline_.interrupt();
    download_ = std::make_unique<GitDownload>(cache_, share_, std::move(order));
    if (auto const begun = download_->begin(); !begun)
        return Failed(begun.error());
    return Begun{download_->has_donors()};
}

void GitFetch::drop_download()
{
    large_files_.reset();
    download_.reset();
}

/// All commits that the tips lead to, and files: a filter leaves out nothing that is asked for by name.
GitOutcome GitFetch::carry_out(FetchHistory const& action)
{
    GitWants wants;
    wants.ids = action.tips;
    wants.filter = git_filter_files_and_folders;
    auto const files = action.with_files ? missing(GitFiles::all) : Ids();
    wants.ids.insert(wants.ids.end(), files.begin(), files.end());
    files_wanted_ = static_cast<std::uint32_t>(files.size());
    return fetch_in_parts(wants, wants.ids, action.with_files);
}

GitOutcome GitFetch::carry_out(SearchHistory const& action)
{
    auto const found = download_->is_in_history(plan_.target().commit, action.tips);
    if (!found)
        return Failed(found.error());
    return *found ? GitOutcome(InHistory()) : GitOutcome(NotInHistory());
}

GitOutcome GitFetch::carry_out(FetchCommit const& action)
{
    GitWants wants;
    wants.shallow = action.shallow;
    if (action.without_files)
        wants.filter = git_filter_files;
    return fetch_in_parts(wants, {action.commit}, false);
}

GitOutcome GitFetch::carry_out(LayOut const& action)
{
    auto const laid_out =
        is_for_worlds() ? download_->find_worlds(action.target) : download_->lay_out(action.target);
    if (!laid_out)
        return Failed(laid_out.error());
    LaidOut outcome;
    outcome.files_missing = missing(GitFiles::all).size();
    files_missing_ = static_cast<std::uint32_t>(outcome.files_missing);
    return outcome;
}

GitOutcome GitFetch::carry_out(FetchFiles const& action)
{
    download_->expect(action.files);
    auto const all = missing(GitFiles::all).size();
    files_wanted_ = files_missing_;
    files_read_ = files_wanted_ - static_cast<std::uint32_t>(all);
    return fetch_in_parts(GitWants(), missing(action.files), action.files != GitFiles::of_project);
}

GitFetch::Ids GitFetch::missing(GitFiles files) const
{
    return is_for_worlds() ? download_->missing_worlds() : download_->missing(files);
}

GitOutcome GitFetch::carry_out(ReadWorlds const&)
{
    auto base = core::concat(order_.project.forge, "/", order_.project.owner, "/", order_.project.repository,
                             "/blob");
    auto const ref = plan_.ref(); // of which the parts are views
    for (auto const part : core::split(ref, '/'))
        base += core::concat("/", core::percent_encode(part));
    worlds_ = download_->read_worlds(base);
    return Done();
}

GitOutcome GitFetch::carry_out(Unpack const&)
{
    return outcome_of(download_->unpack());
}

GitOutcome GitFetch::carry_out(FindLargeFiles const&)
{
    LfsOrder order;
    order.forge = order_.project.forge;
    order.url = url_;
    order.repository = core::concat(order_.project.owner, "/", order_.project.repository);
    order.max_bytes = order_.limits.bytes;
    order.limits = deadline_.limits(config_.low_speed, order_.limits.bytes);
    order.share = &share_;
    order.progress = order_.progress;
    order.interrupt = deadline_.interrupt();
    large_files_.emplace(http_, std::move(order), download_->index(), download_->files_folder(),
                         download_->scratch_folder());
    auto const found = large_files_->find();
    if (!found)
        return Failed(found.error());
    return *found ? GitOutcome(PointersFound()) : GitOutcome(Done());
}

GitOutcome GitFetch::carry_out(FetchLargeFiles const&)
{
    return outcome_of(large_files_->fetch());
}

GitOutcome GitFetch::carry_out(Publish const&)
{
    auto published = download_->publish(url_, plan_.target());
    if (!published)
        return Failed(published.error());
    snapshot_ = std::move(*published);
    return Done();
}

GitOutcome GitFetch::carry_out(MakeRoom const&)
{
    drop_download();
    if (!cache_.make_room())
        return Failed(errc::unavailable);
    received_ = unpacked_ = 0;
    return Done();
}

// ---- packs ---------------------------------------------------------------------------------------------

/// What is requested in vain does not count against the limits.
GitOutcome GitFetch::fetch_in_parts(GitWants wants, Ids const& ids, bool parents_may_stop)
{
    auto const received = received_;
    auto const unpacked = unpacked_;
    for (std::size_t begin = 0; begin < ids.size(); begin += core::max_git_wants) {
        auto const end = std::min(ids.size(), begin + core::max_git_wants);
        wants.ids.assign(ids.begin() + begin, ids.begin() + end);
        auto outcome = fetch_pack(wants);
        if (std::holds_alternative<PackReceived>(outcome))
            continue;
        given_up_ += received_ - received;
        received_ = received;
        unpacked_ = unpacked;
        if (parents_may_stop && download_->parents_stopped())
            return ParentFilesStopped{download_->parents_too_large()};
        return outcome;
    }
    return PackReceived();
}

GitOutcome GitFetch::fetch_pack(GitWants const& wants)
{
    auto const& limits = order_.limits;
    GitPackReader pack(download_->staging(), limits.bytes, deadline_.interrupt(), unpacked_);
    auto const before = received_;
    auto const progress = [&](GitPackReader const& reader, std::uint64_t received) {
        received_ = before + received;
        report(wants, reader);
    };
    auto fetched = peer_.fetch(wants, capabilities_.version_2,
                               peer_limits(limits.bytes - std::min(limits.bytes, before)), pack, progress);
    if (fetched && !capabilities_.version_2 && !download_->staging().find(wants.ids.front()))
        fetched = Failure(GitProblem::no_such_commit);
    unpacked_ = pack.unpacked();
    if (files_wanted_ > 0)
        files_read_ += pack.objects_read();
    return fetched ? GitOutcome(PackReceived()) : GitOutcome(Failed(fetched.error(), pack.begun()));
}

/// How much is still to come is known of the last pack only; a browser must not see it start anew.
void GitFetch::report(GitWants const& wants, GitPackReader const& pack)
{
    if (!order_.progress)
        return;
    auto const received = received_ + given_up_;
    if (!wants.filter.empty() && files_wanted_ == 0)
        order_.progress->report(0, 0, received);
    else if (wants.filter.empty() && files_wanted_ > 0)
        order_.progress->report(files_wanted_, std::min(files_wanted_, files_read_ + pack.objects_read()),
                                received);
    else
        order_.progress->report(pack.objects_total(), pack.objects_read(), received);
}

// ---- limits --------------------------------------------------------------------------------------------

GitPeer::Limits GitFetch::peer_limits(std::uint64_t bytes)
{
    return {deadline_.limits(config_.low_speed, bytes), &share_};
}

} // namespace webots_cloud::adapters
