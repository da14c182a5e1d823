#include "unit_test.hpp"

#include "async/task_group.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/project_fetcher.hpp>
#include <webots_cloud/testing/memory_project_source.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/world.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <optional>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(project_fetcher)

namespace {

/// Records its requests, and removes directories slowly, or fails to.
class Source final : public ProjectSource
{
public:
    explicit Source(Clock& clock) : projects(clock), clock_(clock) {}

    asio::awaitable<result<FetchedProject>> fetch(FetchOrder order) override
    {
        orders.push_back(order);
        auto fetched = co_await projects.fetch(std::move(order));
        if (throws)
            throw std::runtime_error("a source's own mistake");
        co_return fetched;
    }

    asio::awaitable<result<>> restore(RestoreOrder order) override
    {
        restores.push_back(order);
        return projects.restore(std::move(order));
    }

    std::vector<std::uint32_t> cached() const override { return projects.in_cache; }

    asio::awaitable<result<>> discard(std::filesystem::path directory) override
    {
        auto const waited = co_await clock_.wait_until(clock_.now() + removal);
        if (!waited)
            co_return waited.error();
        if (!obstacle.empty())
            co_return Failure(errc::unavailable, obstacle);
        co_return co_await projects.discard(std::move(directory));
    }

    testing::MemoryProjectSource projects;
    std::vector<FetchOrder> orders;
    std::vector<RestoreOrder> restores;
    Duration removal{};   ///< How long removing a directory takes.
    std::string obstacle; ///< Why removing one fails; empty: it succeeds.
    bool throws = false;  ///< When a fetch has left its files.

private:
    Clock& clock_;
};

ProjectFetcherParams fetcher_params()
{
    ProjectFetcherParams params;
    params.instances = "/instances";
    params.limits.bytes = 1234;
    params.limits.files = 56;
    params.limits.timeout = 78s;
    return params;
}

/// Two forges and websites. At its end no directory may be left.
struct Fixture
{
    Fixture()
        : fetcher(fetcher_params(), {Forge("https://github.com", github), Forge("https://lab.org", lab)},
                  log.logger(), &websites)
    {
        github.projects.add("o/r", "a.wbt", "#VRML_SIM R2023b utf8");
        lab.projects.add("o/r", "a.wbt");
        websites.projects.add("robots", "a.wbt");
    }

    ~Fixture()
    {
        BOOST_TEST(tasks.size() == 0u);
        for (auto* const source : {&github, &lab, &websites})
            BOOST_TEST(source->projects.directories().empty());
        BOOST_TEST(world.clock.pending() == 0u);
    }

    ProjectRef parse(std::string_view url) { return fetcher.parse(url).value(); }

    result<Project> fetch(std::string_view url = "https://github.com/o/r/blob/main/worlds/a.wbt")
    {
        return world.run(fetcher.fetch(parse(url), std::make_shared<FetchProgress>()));
    }

    static WebsiteProject website()
    {
        WebsiteProject project;
        project.origin = "https://w.org";
        project.project = "robots";
        project.world = "a.wbt";
        return project;
    }

    void discard(result<Project>& project) { world.run(fetcher.discard(std::move(*project))); }

    testing::World world;
    testing::RecordingLog log;
    Source github{world.clock};
    Source lab{world.clock};
    Source websites{world.clock};
    ProjectFetcher fetcher;
    async::TaskGroup tasks{world.executor()};
};

using Fetched = std::optional<result<Project>>;

asio::awaitable<void> fetch_into(ProjectFetcher& fetcher, ProjectRef ref, Fetched& fetched)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto project = co_await fetcher.fetch(std::move(ref), std::make_shared<FetchProgress>());
    fetched.emplace(std::move(project));
}

/// Then waits for an hour, unless it is cancelled: `threw`.
asio::awaitable<void> fetch_and_wait(Fixture& fixture, ProjectRef ref, bool& threw)
{
    auto project = co_await fixture.fetcher.fetch(std::move(ref), std::make_shared<FetchProgress>());
    if (project)
        co_await fixture.fetcher.discard(std::move(*project));
    try {
        for (int waits = 0; waits < 3600; ++waits)
            co_await fixture.world.clock.wait_until(fixture.world.clock.now() + 1s);
    } catch (boost::system::system_error const&) {
        threw = true;
    }
}

} // namespace

BOOST_AUTO_TEST_CASE(a_project_says_where_it_is_and_what_was_fetched)
{
    Fixture fixture;
    fixture.github.projects.notice = "It may be out of date.";
    auto project = fixture.fetch();
    BOOST_TEST_REQUIRE(project.has_value());
    BOOST_TEST(project->directory == "/instances/1");
    BOOST_TEST(project->root == "/instances/1/project");
    BOOST_TEST(project->world == "/instances/1/project/worlds/a.wbt");
    BOOST_TEST(project->world_header == "#VRML_SIM R2023b utf8");
    BOOST_TEST(project->revision == "0123456789");
    BOOST_TEST(project->notice == "It may be out of date.");
    BOOST_TEST(project->ref.owner == "o");
    BOOST_TEST(!project->website.has_value());
    fixture.discard(project);
}

BOOST_AUTO_TEST_CASE(no_directory_is_ever_used_again)
{
    Fixture fixture;
    auto first = fixture.fetch();
    fixture.discard(first);
    BOOST_TEST(!fixture.fetch("https://github.com/o/r/blob/main/worlds/none.wbt").has_value());
    auto third = fixture.fetch();
    BOOST_TEST(third->directory == "/instances/3");
    fixture.discard(third);
}

BOOST_AUTO_TEST_CASE(a_source_gets_the_limits_and_the_progress_that_is_shown)
{
    Fixture fixture;
    auto const progress = std::make_shared<FetchProgress>();
    auto project = fixture.world.run(
        fixture.fetcher.fetch(fixture.parse("https://github.com/o/r/blob/main/worlds/a.wbt"), progress));
    auto const& order = fixture.github.orders.at(0);
    BOOST_TEST(order.limits.bytes == 1234u);
    BOOST_TEST(order.limits.files == 56u);
    BOOST_TEST((order.limits.timeout == 78s));
    BOOST_TEST((order.progress == progress));
    BOOST_TEST(progress->bytes_received == 12'300'000u);
    fixture.discard(project);
}

BOOST_AUTO_TEST_CASE(each_forge_fetches_restores_and_removes_what_is_its_own)
{
    Fixture fixture;
    auto project = fixture.fetch("https://lab.org/o/r/blob/main/worlds/a.wbt");
    BOOST_TEST_REQUIRE(project.has_value());
    BOOST_TEST(fixture.lab.projects.directories().size() == 1u);
    BOOST_TEST(fixture.github.orders.empty());
    fixture.lab.projects.files = {"controllers/c/c.py"};
    BOOST_TEST(fixture.world.run(fixture.fetcher.restore(*project, "controllers/c/c.py")).has_value());
    auto const& order = fixture.lab.restores.at(0);
    BOOST_TEST(order.directory == "/instances/1");
    BOOST_TEST(order.root == "/instances/1/project");
    BOOST_TEST(order.project.repository == "r");
    BOOST_TEST(order.file == "controllers/c/c.py");
    BOOST_TEST((fixture.world.run(fixture.fetcher.restore(*project, "none.py")).error() == errc::not_found));
    fixture.discard(project);
    BOOST_TEST(fixture.lab.projects.directories().empty());
}

BOOST_AUTO_TEST_CASE(what_is_cached_is_told_of_all_forges_and_no_more_than_a_report_has)
{
    Fixture fixture;
    BOOST_TEST(fixture.fetcher.cached().empty());
    fixture.github.projects.in_cache = {1, 2, 3};
    fixture.lab.projects.in_cache = {11};
    BOOST_TEST((fixture.fetcher.cached() == std::vector<std::uint32_t>{1, 11, 2, 3}));
    fixture.github.projects.in_cache.assign(LoadReport::max_projects, 7);
    fixture.lab.projects.in_cache.assign(LoadReport::max_projects, 8);
    auto const all = fixture.fetcher.cached();
    BOOST_TEST(all.size() == LoadReport::max_projects);
    BOOST_TEST((std::ranges::count(all, 8u) == 64));
    ProjectFetcher const one_source(
        fetcher_params(), {Forge("https://github.com", fixture.lab), Forge("https://lab.org", fixture.lab)},
        fixture.log.logger());
    fixture.lab.projects.in_cache = {5};
    BOOST_TEST((one_source.cached() == std::vector<std::uint32_t>{5}));
}

BOOST_AUTO_TEST_CASE(projects_of_websites_have_a_source_of_their_own_for_all_of_their_life)
{
    Fixture fixture;
    auto project =
        fixture.world.run(fixture.fetcher.fetch(Fixture::website(), std::make_shared<FetchProgress>()));
    BOOST_TEST_REQUIRE(project.has_value());
    BOOST_TEST(project->world == "/instances/1/project/worlds/a.wbt");
    BOOST_TEST(project->website->project == "robots");
    BOOST_TEST(fixture.github.orders.empty());
    fixture.websites.projects.files = {"c.py"};
    BOOST_TEST(fixture.world.run(fixture.fetcher.restore(*project, "c.py")).has_value());
    BOOST_TEST(fixture.websites.restores.at(0).website->project == "robots");
    fixture.discard(project);
    BOOST_TEST(fixture.websites.projects.directories().empty());
}

BOOST_AUTO_TEST_CASE(without_a_source_for_websites_they_are_refused_and_no_number_is_used_up)
{
    Fixture fixture;
    ProjectFetcher without(fetcher_params(), {Forge("https://github.com", fixture.github)},
                           fixture.log.logger());
    auto const refused =
        fixture.world.run(without.fetch(Fixture::website(), std::make_shared<FetchProgress>()));
    BOOST_TEST_REQUIRE(!refused.has_value());
    BOOST_TEST(refused.error() == errc::refused);
    BOOST_TEST(refused.error().detail() == "This simulation server runs no projects of websites.");
    auto project = fixture.world.run(without.fetch(
        fixture.parse("https://github.com/o/r/blob/main/worlds/a.wbt"), std::make_shared<FetchProgress>()));
    BOOST_TEST(project->directory == "/instances/1");
    fixture.discard(project);
}

BOOST_AUTO_TEST_CASE(only_worlds_of_its_forges_are_understood)
{
    Fixture fixture;
    BOOST_TEST(fixture.fetcher.forge_of("https://lab.org/o/r/blob/main/worlds/a.wbt").value().address.url ==
               "https://lab.org");
    BOOST_TEST(fixture.parse("https://lab.org/o/r/blob/main/worlds/a.wbt").forge == "https://lab.org");
    for (std::string const url : {"https://evil.org/o/r/blob/main/worlds/a.wbt",
                                  "https://lab.org.evil.org/o/r/blob/main/worlds/a.wbt", "nonsense", ""}) {
        BOOST_TEST(!fixture.fetcher.forge_of(url).has_value(), url);
        BOOST_TEST(!fixture.fetcher.parse(url).has_value(), url);
    }
}

BOOST_AUTO_TEST_CASE(a_fetch_that_fails_leaves_no_directory_and_the_reason_is_the_sources)
{
    Fixture fixture;
    fixture.github.projects.fuse = testing::Fuse(1);
    auto const unreachable = fixture.fetch();
    BOOST_TEST_REQUIRE(!unreachable.has_value());
    BOOST_TEST(unreachable.error() == errc::unreachable);
    BOOST_TEST(unreachable.error().detail() == "the fuse blew");
    BOOST_TEST(fixture.github.projects.directories().empty());
    auto const missing = fixture.fetch("https://github.com/o/r/blob/main/worlds/none.wbt");
    BOOST_TEST((missing.error() == errc::not_found));
    BOOST_TEST(missing.error().detail() == "none.wbt does not exist.");
    BOOST_TEST(fixture.github.projects.directories().empty());
    BOOST_TEST(fixture.log.lines.empty()); // the caller gets the error instead
}

BOOST_AUTO_TEST_CASE(a_fetch_that_is_cancelled_completes_when_its_directory_is_gone)
{
    Fixture fixture;
    fixture.github.projects.delay = 10s;
    fixture.github.removal = 3s;
    Fetched fetched;
    auto const task = fixture.tasks.spawn(
        fetch_into(fixture.fetcher, fixture.parse("https://github.com/o/r/blob/main/worlds/a.wbt"), fetched));
    fixture.world.advance(5s);
    async::TaskGroup::cancel(task);
    fixture.world.advance(1s);
    BOOST_TEST(!fetched.has_value()); // it is still being removed
    BOOST_TEST(fixture.github.projects.directories().size() == 1u);
    async::TaskGroup::cancel(task); // a second time
    fixture.world.settle();
    BOOST_TEST(!fetched.has_value());
    fixture.world.advance(2s);
    BOOST_TEST(fixture.github.projects.directories().empty());
    BOOST_TEST_REQUIRE(fetched.has_value());
    BOOST_TEST_REQUIRE(!fetched->has_value());
    BOOST_TEST((fetched->error().code() == asio::error::operation_aborted));
}

BOOST_AUTO_TEST_CASE(whoever_has_fetched_can_be_cancelled_and_throws_as_before)
{
    for (bool const fails : {false, true}) {
        Fixture fixture;
        fixture.github.projects.finishes = true; // a source may disable cancellation
        auto const world = fails ? "none.wbt" : "a.wbt";
        bool threw = false;
        auto const task = fixture.tasks.spawn(fetch_and_wait(
            fixture, fixture.parse(std::string("https://github.com/o/r/blob/main/worlds/") + world), threw));
        fixture.world.advance(5s);
        BOOST_TEST(!threw);
        async::TaskGroup::cancel(task);
        fixture.world.settle();
        BOOST_TEST(threw);
    }
}

// Whoever cancels it, as `fetch(…) || wait`, gets nothing that could be discarded.
BOOST_AUTO_TEST_CASE(a_project_that_arrives_although_its_fetch_was_cancelled_is_discarded)
{
    Fixture fixture;
    fixture.github.projects.delay = 10s;
    fixture.github.projects.finishes = true;
    Fetched fetched;
    auto const task = fixture.tasks.spawn(
        fetch_into(fixture.fetcher, fixture.parse("https://github.com/o/r/blob/main/worlds/a.wbt"), fetched));
    fixture.world.advance(5s);
    async::TaskGroup::cancel(task);
    fixture.world.advance(5s);
    BOOST_TEST_REQUIRE(fetched.has_value());
    BOOST_TEST_REQUIRE(!fetched->has_value());
    BOOST_TEST((fetched->error().code() == asio::error::operation_aborted));
    BOOST_TEST(fixture.github.projects.directories().empty());
}

BOOST_AUTO_TEST_CASE(what_a_source_has_left_that_throws_is_discarded)
{
    Fixture fixture;
    fixture.github.throws = true;
    BOOST_CHECK_THROW(fixture.fetch(), std::runtime_error);
    BOOST_TEST(fixture.github.projects.directories().empty());
}

BOOST_AUTO_TEST_CASE(a_project_of_a_forge_that_there_is_not_is_refused)
{
    Fixture fixture;
    auto ref = fixture.parse("https://github.com/o/r/blob/main/worlds/a.wbt");
    ref.forge = "https://elsewhere.org";
    auto const fetched = fixture.world.run(fixture.fetcher.fetch(ref, std::make_shared<FetchProgress>()));
    BOOST_TEST((fetched.error() == errc::invalid_url));
    BOOST_TEST(fetched.error().message() == "no forge has the address \"https://elsewhere.org\"");
    BOOST_TEST((fixture.world.run(fixture.fetcher.current_revision(ref)).error() == errc::invalid_url));
    BOOST_TEST(
        (fixture.world.run(fixture.fetcher.list_worlds(ref, FetchLimits())).error() == errc::invalid_url));
}

BOOST_AUTO_TEST_CASE(a_directory_that_can_not_be_removed_is_told_to_the_operator_and_hides_no_reason)
{
    Fixture fixture;
    fixture.github.obstacle = "Permission denied";
    auto const failed = fixture.fetch("https://github.com/o/r/blob/main/worlds/none.wbt");
    BOOST_TEST((failed.error() == errc::not_found));
    BOOST_TEST(fixture.log.contains("Can't remove /instances/1: Permission denied"));
    auto project = fixture.fetch();
    fixture.discard(project);
    BOOST_TEST(fixture.log.contains("Can't remove /instances/2: Permission denied"));
    fixture.github.obstacle.clear();
    for (auto const directory : {"/instances/1", "/instances/2"})
        (void)fixture.world.run(fixture.github.discard(directory));
}

BOOST_AUTO_TEST_SUITE_END()
