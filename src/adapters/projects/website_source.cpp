// Makes the project of a website: the operator's template, then the website's archive over it. Everything
// that the website sends is checked where it is used; core/projects/website_plan decides in which order
// things happen.
#include "adapters/files/copy_tree.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/files/restore_file.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "download.hpp"
#include "fetch_deadline.hpp"
#include "project_world.hpp"
#include "zip_unpack.hpp"

#include "core/projects/website_plan.hpp"
#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"

#include <webots_cloud/adapters/projects.hpp>

#include <boost/asio/error.hpp>

#include <fcntl.h>

#include <sys/stat.h>

#include <fstream>
#include <optional>
#include <unordered_map>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

constexpr std::size_t threads = 4; // for work on this machine, and as many for each website
constexpr mode_t runnable = 0775;  // protocol 5.2
constexpr std::size_t max_key_length = 4096;

/// The key for a host, which is a safe file name; empty when there is none.
result<std::string> read_key(fs::path const& keys, std::string const& host)
{
    std::error_code failed;
    auto const path = keys / host;
    auto const unreadable = core::refused(core::Refused::unreadable_website_key, {{"host", host}});
    if (!fs::is_regular_file(path, failed)) // a pipe would block us
        return failed == std::errc::permission_denied ? result<std::string>(unreadable) : std::string();
    std::ifstream file(path, std::ios::binary);
    std::string text(max_key_length, '\0');
    if (!file.read(text.data(), static_cast<std::streamsize>(text.size())) && !file.eof())
        return unreadable;
    text.resize(static_cast<std::size_t>(file.gcount()));
    return core::website_key(text);
}

/// What went wrong on the way to a website.
Failure unreachable(std::string const& host, Failure const& failure)
{
    if (failure.code() == asio::error::operation_aborted)
        return failure;
    return core::refused(failure.code(), core::Refused::website_unreachable,
                         {{"host", host}, {"words", failure.message()}});
}

/// One project being made.
class WebsiteFetch
{
public:
    WebsiteFetch(adapters::CurlHttp& http, WebsiteSourceConfig const& config,
                 std::shared_ptr<FetchBudget> budget, core::WebsitePlan const& plan, FetchOrder const& order,
                 std::atomic<bool> const& aborted)
        : http_(http), config_(config), plan_(plan), order_(order), project_(*order.website),
          aborted_(aborted), deadline_(&aborted, order.limits.timeout),
          share_(std::move(budget),
                 deadline_.waiting([this](bool waits) { order_.progress->waiting = waits; }))
    {}

    result<FetchedProject> run()
    {
        if (auto const copied = copy_template(); !copied)
            return copied.error();
        std::string revision = "template";
        if (plan_.download) {
            auto const changed = lay_over();
            if (!changed)
                return changed.error();
            if (*changed)
                revision = concat("changed by user ", core::printable(project_.user1_id, 40));
        }
        return finish(std::move(revision));
    }

private:
    result<> copy_template()
    {
        auto const from = config_.projects / plan_.project;
        std::error_code failed;
        if (config_.projects.empty() || !fs::is_directory(from, failed))
            return core::refused(core::Refused::no_template,
                                 {{"name", core::printable(project_.project, 100)}});
        fs::create_directory(order_.directory, failed);
        if (failed)
            return adapters::disk_failure(failed);
        return adapters::copy_tree(from, order_.directory, order_.limits, *order_.progress, aborted_);
    }

    /// True when the website had something for this user.
    result<bool> lay_over()
    {
        auto const root = adapters::open_folder(AT_FDCWD, order_.directory.c_str());
        if (!root)
            return root.error();
        auto const archive = download_archive(root->get());
        if (!archive)
            return archive.error();
        if (!*archive)
            return false;
        adapters::UnpackLimits limits;
        limits.entries = order_.limits.files;
        limits.bytes = order_.limits.bytes;
        limits.share = &share_;
        auto left_out = adapters::unpack_zip((*archive)->get(), root->get(), limits, deadline_.interrupt());
        if (!left_out)
            return left_out.error();
        forbidden_ = std::move(*left_out);
        if (auto const done = adapters::make_runnable(order_.directory, runnable); !done)
            return done.error();
        return true;
    }

    /// Nothing: the user has changed nothing.
    result<std::optional<adapters::FileDescriptor>> download_archive(int folder)
    {
        auto const host = project_.host();
        adapters::CurlRequest request;
        request.peer = "the website";
        request.base = project_.origin;
        request.url = plan_.download->url;
        request.agent = "webots_cloud";
        request.headers.push_back(concat("Content-Type: ", core::form_type));
        request.body = plan_.download->form;
        request.explain = [&host](Failure const& failure) { return unreachable(host, failure); };
        auto const limits = deadline_.limits(config_.low_speed, order_.limits.bytes);
        auto answer = adapters::download(http_, std::move(request), limits, folder, share_, *order_.progress);
        if (!answer)
            return answer.error();
        if (answer->status != 200)
            return core::refused(core::Refused::website_status,
                                 {{"host", host}, {"status", std::to_string(answer->status)}});
        switch (core::classify_download(answer->beginning)) {
        case core::DownloadAnswer::unchanged:
            return std::optional<adapters::FileDescriptor>();
        case core::DownloadAnswer::refused:
            return core::download_refusal(answer->beginning);
        case core::DownloadAnswer::archive:
            break;
        }
        return std::optional(std::move(answer->file));
    }

    /// Written last: neither template nor archive can name another website.
    result<> write_host_file()
    {
        std::error_code failed;
        fs::remove_all(order_.directory / "host.txt", failed);
        if (failed)
            return adapters::disk_failure(failed);
        auto const root = adapters::open_folder(AT_FDCWD, order_.directory.c_str());
        if (!root)
            return root.error();
        return adapters::write_file(root->get(), "host.txt", plan_.host_file, 0644);
    }

    result<FetchedProject> finish(std::string revision)
    {
        if (auto const written = write_host_file(); !written)
            return written.error();
        auto fetched = adapters::finished_project(order_.directory, std::move(revision), project_.world);
        if (fetched)
            fetched->forbidden = std::move(forbidden_);
        return fetched;
    }

    adapters::CurlHttp& http_;
    WebsiteSourceConfig const& config_;
    core::WebsitePlan const& plan_;
    FetchOrder const& order_;
    WebsiteProject const& project_;
    std::atomic<bool> const& aborted_;
    adapters::FetchDeadline deadline_;
    adapters::FetchShare share_;
    std::vector<std::string> forbidden_; ///< What the archive has beside the project, for its author.
};

/// Projects of websites: decides what is to be done (`plan_website_project`), and does it on threads.
class WebsiteSource final : public ProjectSource
{
public:
    WebsiteSource(WebsiteSourceConfig config, HttpClientConfig http, Logger log,
                  std::shared_ptr<FetchBudget> budget)
        : config_(std::move(config)), log_(std::move(log)), budget_(std::move(budget)),
          http_(std::move(http)), local_(threads, adapters::BlockingPool::Priority::background)
    {}

    asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) override
    {
        co_await asio::this_coro::throw_if_cancelled(false);
        if (!order.website)
            co_return Failure(errc::invalid_argument, "this order names no project of a website");
        auto const host = order.website->host();
        auto look = [keys = config_.keys, host] { return read_key(keys, host); };
        auto const key = co_await local_.run(std::move(look));
        if (!key)
            co_return key.error();
        auto plan = core::plan_website_project(*order.website, *key);
        if (!plan)
            co_return plan.error();
        if (key->empty())
            log_.warning(LogCause("website"), concat("No key for: ", host));
        auto& pool = plan->download ? pool_of(host) : local_;
        auto work = [this, order = std::move(order),
                     plan = std::move(*plan)](std::atomic<bool> const& aborted) {
            return WebsiteFetch(http_, config_, budget_, plan, order, aborted).run();
        };
        co_return co_await pool.run_abortable(std::move(work));
    }

    /// Out of the template: what a user of the website changed there is what a reset undoes.
    asio::awaitable<result<>> restore(RestoreOrder order) override
    {
        auto const is_runnable = core::is_runnable_name(fs::path(order.file).filename().string());
        auto work = [from = config_.projects / order.website->project, also = is_runnable ? runnable : 0,
                     order = std::move(order)] {
            return adapters::restore_file(from, order.root, order.file, also);
        };
        co_return co_await local_.run(std::move(work));
    }

    asio::awaitable<result<>> discard(fs::path directory) override
    {
        auto work = [directory = std::move(directory)] { return adapters::remove_tree(directory); };
        co_return co_await local_.run(std::move(work));
    }

private:
    /// Each website has its own threads, so that a slow one does not delay others. At most one pool per key.
    adapters::BlockingPool& pool_of(std::string const& host)
    {
        return downloading_.try_emplace(host, threads, adapters::BlockingPool::Priority::background)
            .first->second;
    }

    WebsiteSourceConfig const config_;
    Logger log_;
    std::shared_ptr<FetchBudget> budget_;
    adapters::CurlHttp http_;
    adapters::BlockingPool local_; // these end their threads before anything that they use goes
    std::unordered_map<std::string, adapters::BlockingPool> downloading_; ///< By host.
};

} // namespace

std::unique_ptr<ProjectSource> make_website_source(WebsiteSourceConfig config, HttpClientConfig http,
                                                   Logger log, std::shared_ptr<FetchBudget> budget)
{
    return std::make_unique<WebsiteSource>(std::move(config), std::move(http), std::move(log),
                                           budget ? std::move(budget) : make_fetch_budget());
}

} // namespace webots_cloud
