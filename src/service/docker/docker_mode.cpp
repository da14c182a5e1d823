// What the simulation server needs of Docker: finding it, preparing a project, counting what containers
// write, and cleaning up. Each of these has a file of its own (docker_*.cpp); this one keeps what they share.
// Decisions: core/docker/container_sizes, core/docker/build_images.
#include <webots_cloud/docker_mode.hpp>

#include "async/first_of.hpp"
#include "async/wakeup.hpp"
#include "core/docker/build_images.hpp"
#include "core/docker/build_limits.hpp"
#include "core/docker/container_sizes.hpp"
#include "core/docker/docker_project.hpp"
#include "core/text.hpp"
#include "docker_build_limits.hpp"
#include "docker_cleanup.hpp"
#include "docker_commands.hpp"
#include "docker_discovery.hpp"
#include "docker_project_files.hpp"

#include <webots_cloud/simulation_launcher.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

// Docker walks through the files of containers, and of all volumes, to count them.
constexpr auto between_counts = std::chrono::seconds(10);
// While a build runs, whose steps may write as fast as the disk takes it.
constexpr auto between_counts_of_builds = std::chrono::seconds(2);

/// What was counted, and when to count again.
struct Counted
{
    WrittenElsewhere written;
    std::size_t names = 0; ///< Which the build had named when its images were counted.
    bool runs = false;     ///< There are containers, so nothing is built any more.
    TimePoint due;
};

} // namespace

struct DockerMode::Impl
{
    Impl(DockerConfig wanted, SimulationLauncherConfig wanted_of_launcher, DockerFacts found,
         ProcessHost& processes, TextFiles& text_files, Clock& clock, Logger logger, DockerModeHooks hooks)
        : config(std::move(wanted)), launching(std::move(wanted_of_launcher)), facts(std::move(found)),
          clock(clock), log(std::move(logger)), commands(launching, facts, processes, clock),
          files(config, launching, facts, text_files, commands, std::move(hooks)),
          cleanup(config, facts, commands, clock, log), build_limits(facts, commands, processes, clock, log)
    {}

    LaunchPlan plan(LaunchSpec const& spec, ContainerProject project) const;
    asio::awaitable<WrittenElsewhere> count(std::string const& project);
    asio::awaitable<std::uint64_t> count_files(core::ContainerSizes const& sizes);
    asio::awaitable<std::optional<std::uint64_t>> count_images(std::set<std::string> const& names);
    asio::awaitable<std::uint64_t> count_steps(std::set<std::string> const& names);
    std::set<std::string> names_in_use() const;
    asio::awaitable<result<>> clean();
    asio::awaitable<void> remove_owed();

    DockerConfig const config;
    SimulationLauncherConfig const launching;
    DockerFacts const facts;
    Clock& clock;
    Logger log;
    DockerCommands commands;
    DockerProjectFiles files;
    DockerCleanup cleanup;
    DockerBuildLimits build_limits;
    DockerEngine engine;
    std::map<std::string, Counted> counted;          ///< Of projects that were not cleared.
    std::map<std::string, core::BuildRecord> builds; ///< Of the same.
    std::set<std::string> ended;                     ///< Projects whose builds docker may still finish.
    std::set<std::string> owed; ///< Projects of which something may be left, since docker did not answer.
    std::optional<async::Wakeup> cleared; ///< While `run()` is awaited.
};

DockerMode::DockerMode(DockerConfig config, SimulationLauncherConfig launching, DockerFacts facts,
                       ProcessHost& processes, TextFiles& files, Clock& clock, Logger log,
                       DockerModeHooks hooks)
    : impl_(std::make_unique<Impl>(std::move(config), std::move(launching), std::move(facts), processes,
                                   files, clock, std::move(log), std::move(hooks)))
{}

DockerMode::~DockerMode() = default;

asio::awaitable<result<>> DockerMode::open()
{
    auto engine = co_await find_docker(impl_->facts, impl_->commands);
    if (!engine)
        co_return engine.error();
    impl_->engine = std::move(*engine);
    impl_->log.info(concat("Simulations run in containers, by ",
                           core::join({impl_->engine.compose.begin(), impl_->engine.compose.end()}, " "),
                           " and ", impl_->engine.runtime));
    if (!impl_->engine.confines_builds)
        impl_->log.warning(
            "Builds of projects may use Docker's own list of system calls, and have capabilities, which "
            "Docker can't take from a single build: docs/docker.md (\"What a build may do\") says what "
            "helps.");
    co_await open_screen(impl_->facts, impl_->commands, impl_->log);
    // Before the first start: containers of a run that was killed may still hold our ports.
    std::string all_projects;
    auto const removed = co_await impl_->cleanup.remove_leftovers(std::move(all_projects));
    if (!removed)
        co_return Failure(errc::unavailable,
                          concat("docker: left-overs can't be removed: ", removed.error().message()));
    co_return result<>();
}

asio::awaitable<result<>> DockerMode::run()
{
    impl_->cleared.emplace(co_await asio::this_coro::executor);
    auto parts = async::first_of(impl_->clean(), impl_->build_limits.run());
    co_return co_await std::move(parts);
}

/// Once, and after each simulation.
asio::awaitable<result<>> DockerMode::Impl::clean()
{
    for (;;) {
        // Those that end during the watch have a watch of their own, in the next round.
        auto const over = std::exchange(ended, {});
        auto const watched = co_await cleanup.watch_builds();
        if (!watched)
            co_return watched;
        // Not before the watch: until then docker may finish a build that was given up, and name its image.
        if (!over.empty())
            co_await cleanup.remove_late_names(over);
        co_await remove_owed();
        if (!owed.empty())
            continue;
        auto const woken = co_await cleared->wait();
        if (!woken)
            co_return woken;
    }
}

/// Tries each once.
asio::awaitable<void> DockerMode::Impl::remove_owed()
{
    auto const tried = owed; // more may come meanwhile
    for (auto const& project : tried) {
        auto const removed = co_await cleanup.remove_leftovers(project);
        if (removed)
            owed.erase(project);
    }
}

asio::awaitable<result<LaunchPlan>> DockerMode::prepare(LaunchSpec const& spec, std::uint16_t port)
{
    auto project = co_await impl_->files.write(spec, port, impl_->engine.runtime);
    if (!project)
        co_return project.error();
    bool const builds = project->builds_what_it_says;
    auto plan = impl_->plan(spec, std::move(*project));
    impl_->builds.try_emplace(plan.project);
    if (builds)
        impl_->build_limits.begin(plan.project);
    co_return plan;
}

LaunchPlan DockerMode::Impl::plan(LaunchSpec const& spec, ContainerProject project) const
{
    auto const& environment = project.environment;
    auto const file = spec.root / "docker-compose.yml";
    LaunchPlan plan;
    plan.project = environment.project;
    if (!project.uses_project_dockerfile)
        plan.image = environment.image;
    plan.announcements = environment.yml.messages;
    plan.notes = std::move(project.notes);
    plan.process = commands.spec(core::compose_up(engine.compose, file));
    plan.process.directory = spec.root;
    // The container has none of Docker's networks. The guard finds it by this label, and gives it ours.
    if (project.own_network) {
        plan.process.network = facts.network;
        plan.process.network.port = environment.port;
        plan.process.container.docker = facts.docker;
        plan.process.container.label = concat(core::simulator_label, "=", project.token);
    }
    plan.process.cleanup_command = core::compose_down(engine.compose, file);
    if (environment.yml.kind == core::ComposeTemplate::competition) {
        plan.restart_controller = commands.spec(core::compose_restart_controller(engine.compose, file));
        plan.restart_controller.directory = spec.root; // compose reads files beside its own
    }
    return plan;
}

asio::awaitable<result<>> DockerMode::put_back(std::string project, std::filesystem::path root,
                                               std::filesystem::path file)
{
    auto list = core::list_containers(project);
    auto const listing = co_await impl_->commands.docker(std::move(list));
    if (!listing)
        co_return listing.error();
    auto const name = file.lexically_relative(root);
    for (auto const& container : core::containers_with_project(*listing)) {
        auto copy = core::copy_into_container(container, file, name);
        auto const copied = co_await impl_->commands.docker(std::move(copy));
        if (!copied)
            co_return copied.error();
    }
    co_return result<>();
}

void DockerMode::note(std::string const& project, std::string_view line)
{
    if (auto const build = impl_->builds.find(project); build != impl_->builds.end())
        build->second.read(line);
}

asio::awaitable<WrittenElsewhere> DockerMode::Impl::count(std::string const& project)
{
    auto list = core::list_container_sizes(project);
    auto const listing = co_await commands.docker(std::move(list));
    auto const sizes = core::parse_container_sizes(listing ? *listing : std::string());
    WrittenElsewhere written;
    written.files = co_await count_files(sizes);
    auto const known = counted.find(project);
    auto const build = builds.find(project);
    if (known == counted.end() || build == builds.end()) // it was cleared meanwhile, or never prepared
        co_return written;
    written.images = known->second.written.images;
    known->second.runs = listing && !core::trim(*listing).empty();
    auto const names = build->second.names(); // more may come meanwhile
    // Where containers run, nothing is built any more, and what was built has been counted.
    if (known->second.runs && known->second.names == names.size())
        co_return written;
    // It has named more steps than any build has. Nobody can say how much they are, so they count as too
    // much.
    if (build->second.is_full()) {
        written.images = ~std::uint64_t{0};
        co_return written;
    }
    auto const images = co_await count_images(names);
    // Docker did not say: the last figure stands, and the names stay uncounted until the next time.
    if (!images)
        co_return written;
    written.images = *images;
    if (auto const still = counted.find(project); still != counted.end())
        still->second.names = names.size();
    co_return written;
}

asio::awaitable<std::uint64_t> DockerMode::Impl::count_files(core::ContainerSizes const& sizes)
{
    if (sizes.volumes.empty())
        co_return sizes.bytes;
    auto list_volumes = core::list_volume_sizes();
    auto const volumes = co_await commands.docker(std::move(list_volumes));
    co_return sizes.bytes + core::volume_bytes(volumes ? *volumes : std::string(), sizes.volumes);
}

/// What a build has made: its images, and what the step that runs has written. Nothing: docker did not say.
asio::awaitable<std::optional<std::uint64_t>>
DockerMode::Impl::count_images(std::set<std::string> const& names)
{
    if (names.empty())
        co_return 0;
    auto list = core::list_image_ids();
    auto const listing = co_await commands.docker(std::move(list));
    auto const ids = core::image_ids(listing ? *listing : std::string(), names);
    if (ids.empty())
        co_return std::nullopt;
    auto describe = core::describe_images(ids);
    auto const description = co_await commands.docker(std::move(describe));
    if (!description) // one has been removed meanwhile
        co_return std::nullopt;
    auto const images = core::added_bytes(core::read_images(*description));
    co_return images + co_await count_steps(names);
}

asio::awaitable<std::uint64_t> DockerMode::Impl::count_steps(std::set<std::string> const& names)
{
    auto list = core::list_step_sizes(names);
    auto const listing = co_await commands.docker(std::move(list));
    std::uint64_t bytes = 0;
    for (auto const& [step, size] : core::read_step_sizes(listing ? *listing : std::string()))
        bytes += size;
    co_return bytes;
}

asio::awaitable<WrittenElsewhere> DockerMode::written(std::string project)
{
    auto const known = impl_->counted.find(project);
    auto const began = impl_->clock.now();
    if (known != impl_->counted.end() && began < known->second.due)
        co_return known->second.written;
    // Set before the question, so that nobody asks docker the same once more while it counts.
    impl_->counted[project].due = began + between_counts;
    auto const written = co_await impl_->count(project);
    auto const now = impl_->clock.now();
    auto const still = impl_->counted.find(project); // it may have been cleared meanwhile
    if (still != impl_->counted.end()) {
        auto const pause = still->second.runs ? between_counts : between_counts_of_builds;
        still->second.written = written;
        still->second.due = std::max<TimePoint>(began + pause, now + 10 * (now - began));
    }
    co_return written;
}

void DockerMode::forget(std::string const& project) noexcept
{
    impl_->counted.erase(project);
    impl_->builds.erase(project);
    impl_->build_limits.end(project);
}

std::set<std::string> DockerMode::Impl::names_in_use() const
{
    std::set<std::string> names;
    for (auto const& [project, build] : builds)
        names.insert(build.names().begin(), build.names().end());
    return names;
}

asio::awaitable<void> DockerMode::clear(std::string project)
{
    forget(project);
    auto const removed = co_await impl_->cleanup.remove_leftovers(project);
    if (!removed) {
        impl_->owed.insert(project);
        impl_->log.error(LogCause("left-over"),
                         concat("docker: of ", project,
                                " something may be left, until docker answers: ", removed.error().message()));
    }
    // `clean` looks after what docker may still create or name, which takes longer than a browser should
    // wait.
    if (impl_->cleared) {
        impl_->ended.insert(project);
        impl_->cleared->notify();
    }
    co_await impl_->cleanup.remove_old_images();
    co_await impl_->cleanup.bound_builds(impl_->names_in_use());
}

} // namespace webots_cloud
