// The git forges as a source of projects: answers from the cache where it can, else starts a fetch on threads
// of its own, one for all who want the same folder. The steps of a fetch are in git_fetch.cpp.
#include "adapters/files/mounts.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/files/restore_file.hpp"
#include "adapters/git_cache/git_cache.hpp"
#include "adapters/git_cache/git_checkout.hpp"
#include "adapters/http_client/curl_http.hpp"
#include "adapters/projects/project_world.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "git_coalesced_fetches.hpp"
#include "git_fetch.hpp"

#include "async/task_group.hpp"
#include "core/git/git_refs.hpp"
#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/projects.hpp>
#include <webots_cloud/load_report.hpp>

#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <unordered_map>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using adapters::BlockingPool;
using adapters::GitSnapshotPtr;
using core::concat;

// Threads that mostly wait for the network, of each forge: for answers, and as many for downloads. One that
// does not answer keeps only its own busy.
constexpr std::size_t fetches_at_once = 8;
constexpr std::size_t copies = 4;   // threads that keep a disk busy, together on one project if need be
constexpr std::size_t cleaners = 2; // others, so that no start waits for what somebody has left

bool on_one_disk(fs::path const& one, fs::path const& other)
{
    struct stat of_one;
    struct stat of_other;
    return ::stat(one.c_str(), &of_one) == 0 && ::stat(other.c_str(), &of_other) == 0 &&
           of_one.st_dev == of_other.st_dev;
}

/// Projects of git forges: a fetch puts a folder into the cache, a checkout hands it out from there.
class GitSource final : public ProjectSource
{
public:
    GitSource(asio::any_io_executor executor, GitSourceConfig config, HttpClientConfig http,
              GitFolders const& folders, Logger log, std::shared_ptr<FetchBudget> budget)
        : config_(std::move(config)), log_(std::move(log)), budget_(std::move(budget)),
          http_(std::move(http)), cache_(folders.cache, config_, budget_),
          checkout_(cache_.folder(), folders.instances), pool_(copies, BlockingPool::Priority::background),
          cleaning_(cleaners, BlockingPool::Priority::background), executor_(std::move(executor))
    {
        if (cache_.usable())
            log_.info(concat("Projects are handed out by ", checkout_.describe(), "."));
        else
            log_.error(concat("Projects can't be fetched: ", cache_.usable().error().message()));
        log_notices();
        cached_ = cache_.projects_at_start();
    }

    asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        if (!cache_.usable())
            co_return core::refused(core::Refused::no_cache);
        auto const executor = co_await asio::this_coro::executor;
        // While the server is asked what the address means now, what it meant the last time is checked out:
        // mostly that is still right.
        HeadStart head_start;
        async::TaskGroup meanwhile(executor);
        meanwhile.spawn(try_head_start(order, head_start));
        auto const url = order.project.clone_url();
        auto const ref_and_folder = order.project.ref_and_folder;
        auto const key = concat(url, "\n", ref_and_folder);
        adapters::GitCoalescedFetches::Make make = maker_of(order, core::GitPurpose::folder);
        auto& fetches = fetches_of(order.project.forge);
        auto const obtained = co_await fetches.join(key, order.progress, std::move(make));
        if (!obtained)
            meanwhile.cancel_all();
        co_await meanwhile.join();
        log_notices();
        if (!obtained)
            co_return obtained.error();
        if (!obtained->notice.empty())
            log_.warning(LogCause("fetch"), obtained->notice);
        // It was right: nothing is left to do. Or it was another state, which has to go first, as both want
        // the same directory.
        auto project = std::move(head_start.project);
        if (!project || head_start.snapshot != obtained->snapshot) {
            if (head_start.snapshot)
                (void)co_await discard(order.directory);
            project = co_await deliver(std::move(order), obtained->snapshot);
        }
        if (project) {
            project->notice = obtained->notice;
            note_use(adapters::project_key_of(url, ref_and_folder));
        }
        co_return project;
    }

    asio::awaitable<result<std::vector<ListedWorld>>> list_worlds(FetchOrder order) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        if (!cache_.usable())
            co_return core::refused(core::Refused::no_cache);
        auto const key = concat("worlds\n", order.project.clone_url(), "\n", order.project.ref_and_folder);
        adapters::GitCoalescedFetches::Make make = maker_of(order, core::GitPurpose::worlds);
        auto const listed =
            co_await fetches_of(order.project.forge).join(key, order.progress, std::move(make));
        if (!listed)
            co_return listed.error();
        co_return listed->worlds;
    }

    RefMeaning ref_meaning() const noexcept override { return RefMeaning::git; }

    std::vector<std::uint32_t> cached() const override { return cached_; }

    asio::awaitable<result<>> restore(RestoreOrder order) override
    {
        auto const found = in_use_.find(order.directory.string());
        if (found == in_use_.end())
            co_return core::refused(core::Refused::project_gone);
        auto work = [snapshot = found->second, order = std::move(order)] {
            return adapters::restore_file(snapshot->files / snapshot->target.folder, order.root, order.file);
        };
        co_return co_await pool_.run(std::move(work));
    }

    asio::awaitable<result<>> discard(fs::path directory) override
    {
        auto work = [directory] { return adapters::remove_tree(directory); };
        auto const removed = co_await cleaning_.run(std::move(work));
        if (in_use_.erase(directory.string()) == 0)
            co_return removed;
        auto trim = [this] { return cache_.trim(); }; // what was in use may have been too much
        co_await cleaning_.run(std::move(trim));
        co_return removed;
    }

private:
    /// What the cache drops stays here until others were used: that is known to threads of the pools alone.
    void note_use(std::uint32_t project)
    {
        std::erase(cached_, project);
        cached_.insert(cached_.begin(), project);
        cached_.resize(std::min(cached_.size(), LoadReport::max_projects));
    }

    void log_notices()
    {
        for (auto const& notice : cache_.take_notices())
            log_.warning(LogCause("cache"), notice);
    }

    /// What was checked out while the server was being asked: what the address meant last time.
    struct HeadStart
    {
        GitSnapshotPtr snapshot; ///< Null: nothing.
        result<FetchedProject> project = Failure(errc::not_found);
    };

    asio::awaitable<void> try_head_start(FetchOrder const& order, HeadStart& head_start)
    {
        if (core::names_commit(order.project.ref_and_folder))
            co_return; // there is no request to be ahead of
        auto work = [this, order](std::atomic<bool> const& aborted) {
            HeadStart made;
            auto const url = order.project.clone_url();
            if (auto const target = cache_.recall(url, order.project.ref_and_folder))
                made.snapshot = cache_.find(url, *target, &aborted);
            if (made.snapshot)
                made.project = make_project(order, *made.snapshot, aborted);
            return made;
        };
        head_start = co_await pool_.run_abortable(std::move(work));
        if (head_start.snapshot)
            in_use_[order.directory.string()] = head_start.snapshot;
    }

    adapters::GitCoalescedFetches& fetches_of(std::string const& forge)
    {
        return fetches_.try_emplace(forge, executor_, fetches_at_once).first->second;
    }

    adapters::GitCoalescedFetches::Make maker_of(FetchOrder const& order, core::GitPurpose purpose)
    {
        return [this, project = order.project, limits = order.limits,
                purpose](std::atomic<bool> const& aborted, adapters::GitProgress& progress) {
            adapters::GitFetchOrder wanted;
            wanted.project = project;
            wanted.purpose = purpose;
            wanted.limits = limits;
            wanted.aborted = &aborted;
            wanted.progress = &progress;
            return adapters::GitFetch(http_, cache_, servers_, config_, budget_, std::move(wanted));
        };
    }

    /// Puts a folder of the cache into the order's directory.
    asio::awaitable<result<FetchedProject>> deliver(FetchOrder order, GitSnapshotPtr snapshot)
    {
        auto const directory = order.directory.string();
        in_use_[directory] = snapshot;
        auto work = [this, order, snapshot](std::atomic<bool> const& aborted) {
            return make_project(order, *snapshot, aborted);
        };
        auto made = co_await pool_.run_abortable(std::move(work));
        if (!made)
            in_use_.erase(directory);
        co_return made;
    }

    result<FetchedProject> make_project(FetchOrder const& order, adapters::GitSnapshot const& snapshot,
                                        std::atomic<bool> const& aborted)
    {
        auto const check_out = [&] {
            return checkout_.check_out(snapshot, order.directory, order.project.repository, pool_, aborted);
        };
        auto root = check_out();
        // The cache gives up what nobody uses, where that makes room on the disk that is full.
        auto const too_little = !root && adapters::is_lack_of_room(root.error());
        if (too_little && on_one_disk(order.directory, cache_.folder()) && cache_.make_room() &&
            adapters::remove_tree(order.directory))
            root = check_out();
        if (!root)
            return root.error();
        auto project =
            adapters::finished_project(std::move(*root), to_hex(snapshot.target.commit), order.project.world);
        if (project)
            project->forbidden = snapshot.index.forbidden;
        else
            adapters::unmount_below(order.directory);
        return project;
    }

    GitSourceConfig const config_;
    Logger log_;
    std::shared_ptr<FetchBudget> budget_;
    adapters::CurlHttp http_;
    adapters::GitServers servers_;
    adapters::GitCache cache_;
    adapters::GitCheckout checkout_;
    /// By directory: what must not leave the cache, be it mounted or wanted again.
    std::unordered_map<std::string, GitSnapshotPtr> in_use_;
    std::vector<std::uint32_t> cached_; ///< Projects, by their key, those used last first.
    BlockingPool pool_; // these and the fetches end their threads before anything that they use goes
    BlockingPool cleaning_;
    asio::any_io_executor executor_;
    std::unordered_map<std::string, adapters::GitCoalescedFetches> fetches_; ///< By forge.
};

} // namespace

std::unique_ptr<ProjectSource> make_git_source(asio::any_io_executor executor, GitSourceConfig config,
                                               HttpClientConfig http, GitFolders folders, Logger log,
                                               std::shared_ptr<FetchBudget> budget)
{
    return std::make_unique<GitSource>(std::move(executor), std::move(config), std::move(http), folders,
                                       std::move(log), budget ? std::move(budget) : make_fetch_budget());
}

} // namespace webots_cloud
