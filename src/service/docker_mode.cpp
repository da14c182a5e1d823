#include <webots_cloud/docker_mode.hpp>

#include "async/wakeup.hpp"
#include "core/docker/docker_leftovers.hpp"
#include "core/docker/docker_project.hpp"
#include "core/text.hpp"
#include "run_program.hpp"

#include <webots_cloud/simulation_launcher.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>

namespace webots_cloud {
namespace asio = boost::asio;
namespace fs = std::filesystem;

using core::concat;

namespace {

constexpr auto command_limit = std::chrono::seconds(60);

// Docker may still be making what a killed compose has asked for.
constexpr int max_rounds = 5;
constexpr auto between_rounds = std::chrono::milliseconds(500);

// Docker starts the steps of builds within this time, however busy the machine is.
constexpr auto between_looks = std::chrono::seconds(10);
constexpr int quiet_looks = 2; // and then no step of a build that was given up will come any more
constexpr int max_looks = 12;

constexpr auto launcher_file = "remote_controller_launcher.py";

using Arguments = std::vector<std::string>;

/// What is read of a project; the order is that of `names`.
struct ProjectTexts
{
    static Arguments names()
    {
        return {"webots.yml", "webots.yaml", "Makefile", "Dockerfile", "docker-compose.yml", ".dockerignore"};
    }

    explicit ProjectTexts(TextsRead const& texts)
        : yml(texts[0] ? *texts[0] : texts[1].value_or("")), make(texts[2]), dockerfile(texts[3]),
          compose(texts[4]), ignored(texts[5].value_or(""))
    {}

    std::string yml;
    bool make;
    std::optional<std::string> dockerfile;
    bool compose;
    std::string ignored;
};

} // namespace

struct DockerMode::Impl
{
    Impl(DockerModeParams parameters, ProcessHost& host, TextFiles& texts, Clock& time, Logger logger)
        : params(std::move(parameters)), processes(host), files(texts), clock(time), log(std::move(logger))
    {}

    ProcessSpec command(Arguments argv) const;
    asio::awaitable<result<std::string>> run(Arguments argv);
    asio::awaitable<result<>> find_compose();
    asio::awaitable<result<>> find_docker();
    asio::awaitable<void> open_screen();

    asio::awaitable<result<std::string>> read_template(std::string name);
    asio::awaitable<result<std::vector<TextFile>>> competition_files(LaunchSpec const& spec);
    result<core::DockerEnvironment> environment(LaunchSpec const& spec, std::uint16_t port) const;
    ContainerPlan plan(LaunchSpec const& spec, core::DockerEnvironment const& environment) const;

    asio::awaitable<result<>> remove_leftovers(core::DockerScope scope);
    asio::awaitable<result<std::size_t>> remove_once(core::DockerScope const& scope);
    asio::awaitable<result<std::size_t>> remove_listed(Arguments list, Arguments removal,
                                                       core::DockerScope const& scope);
    asio::awaitable<result<>> watch_builds();
    asio::awaitable<void> remove_builds(Arguments containers);
    asio::awaitable<void> remove_old_images();
    Arguments list_containers() const;

    DockerModeParams params;
    ProcessHost& processes;
    TextFiles& files;
    Clock& clock;
    Logger log;
    Arguments compose; ///< The beginning of its command line.
    std::string runtime = "runc";
    std::set<std::string> projects;       ///< That were prepared and are not cleared.
    std::optional<async::Wakeup> cleared; ///< While `run()` is awaited.
};

DockerMode::DockerMode(DockerModeParams params, ProcessHost& processes, TextFiles& files, Clock& clock,
                       Logger log)
    : impl_(std::make_unique<Impl>(std::move(params), processes, files, clock, std::move(log)))
{}

DockerMode::~DockerMode() = default;

ProcessSpec DockerMode::Impl::command(Arguments argv) const
{
    ProcessSpec spec;
    spec.argv = std::move(argv);
    spec.environment = core::docker_environment(params.environment, params.simulator_environment);
    spec.directory = "/";
    spec.grace = Duration::zero();
    return spec;
}

asio::awaitable<result<std::string>> DockerMode::Impl::run(Arguments argv)
{
    return run_program(processes, clock, command(std::move(argv)), command_limit);
}

// --- at the start of the server -----------------------------------------------------------------------

asio::awaitable<result<>> DockerMode::open()
{
    auto const found = co_await impl_->find_docker();
    if (!found)
        co_return found;
    co_await impl_->open_screen();
    core::DockerScope scope;
    scope.identity = impl_->params.identity;
    auto const removed = co_await impl_->remove_leftovers(std::move(scope));
    if (!removed)
        co_return Failure(errc::unavailable,
                          concat("docker: left-overs can't be removed: ", removed.error().message()));
    co_return result<>();
}

asio::awaitable<result<>> DockerMode::Impl::find_docker()
{
    if (params.docker.empty())
        co_return Failure(
            errc::not_found,
            "docker: there is no program \"docker\". Install Docker, or set \"docker\" to false.");
    auto const found = co_await find_compose();
    if (!found)
        co_return found;
    Arguments info{params.docker.string(), "info", "--format",
                   "Docker {{.ServerVersion}} has {{range $name, $_ := .Runtimes}}{{$name}} {{end}}"};
    auto const runtimes = co_await run(std::move(info));
    // Newer clients call it a success to know no version of a daemon that they can't reach, and may warn
    // beside it.
    bool const answers = runtimes && runtimes->find("Docker ") != std::string::npos &&
                         runtimes->find("Docker  has") == std::string::npos;
    if (!answers)
        co_return Failure(errc::unavailable, concat("docker: the daemon does not answer: ",
                                                    runtimes ? "Is it running, and may this user use it?"
                                                             : runtimes.error().message()));
    if (concat(" ", *runtimes).find(" nvidia ") != std::string::npos)
        runtime = "nvidia";
    log.info(concat("Simulations run in containers, by ", core::join({compose.begin(), compose.end()}, " "),
                    " and ", runtime));
    co_return result<>();
}

asio::awaitable<result<>> DockerMode::Impl::find_compose()
{
    Arguments candidate{params.docker.string(), "compose"};
    Arguments ask{params.docker.string(), "compose", "version"};
    auto answer = co_await run(std::move(ask));
    if (!answer && !params.docker_compose.empty()) {
        candidate = {params.docker_compose.string()};
        Arguments ask_other{params.docker_compose.string(), "version"};
        answer = co_await run(std::move(ask_other));
    }
    if (!answer)
        co_return Failure(errc::not_found, "docker: neither \"docker compose\" nor \"docker-compose\" can be "
                                           "run. Install one of them (package "
                                           "docker-compose), or set \"docker\" to false.");
    compose = std::move(candidate);
    co_return result<>();
}

asio::awaitable<void> DockerMode::Impl::open_screen()
{
    if (params.xhost.empty())
        co_return;
    Arguments argv{params.xhost.string(), "+local:root"};
    auto spec = command(std::move(argv));
    spec.environment.emplace_back("DISPLAY", params.display);
    auto const opened = co_await run_program(processes, clock, std::move(spec), command_limit);
    if (!opened)
        log.warning(
            concat("Containers can't use the screen ", params.display, ": ", opened.error().message()));
}

// --- before a simulation ------------------------------------------------------------------------------

asio::awaitable<result<ContainerPlan>> DockerMode::prepare(LaunchSpec const& spec, std::uint16_t port)
{
    auto& files = impl_->files;
    auto const texts = co_await files.read(spec.root, ProjectTexts::names());
    if (!texts)
        co_return texts.error();
    ProjectTexts const project(*texts);
    auto environment = impl_->environment(spec, port);
    if (!environment)
        co_return environment.error();
    auto const yml = core::parse_webots_yml(project.yml);
    if (!yml)
        co_return yml.error();
    environment->yml = *yml;
    environment->make = project.make;
    auto const values = core::env_file(*environment);
    if (!values)
        co_return values.error();
    auto const compose_file = co_await impl_->read_template(core::compose_template_file(yml->kind));
    if (!compose_file)
        co_return compose_file.error();

    std::vector<TextFile> added;
    if (yml->kind == core::ComposeTemplate::competition) {
        auto more = co_await impl_->competition_files(spec);
        if (!more)
            co_return more.error();
        added = std::move(*more);
    }
    bool const own_dockerfile = project.dockerfile && impl_->params.project_dockerfiles;
    if (own_dockerfile) {
        added.emplace_back("Dockerfile", core::with_server_label(*project.dockerfile, environment->server));
    } else {
        auto dockerfile = co_await impl_->read_template(core::dockerfile_template);
        if (!dockerfile)
            co_return dockerfile.error();
        added.emplace_back("Dockerfile", std::move(*dockerfile));
    }
    added.emplace_back(".env", *values);
    added.emplace_back("docker-compose.yml", *compose_file);
    // Without what differs from one simulation to the next, docker builds a project once and remembers it.
    added.emplace_back(".dockerignore",
                       concat(project.ignored, "\n.env\ndocker-compose.yml\n.dockerignore\n"));
    auto const written = co_await files.write(spec.root, std::move(added));
    if (!written)
        co_return written.error();

    auto plan = impl_->plan(spec, *environment);
    if (own_dockerfile)
        plan.image.clear();
    else if (project.dockerfile)
        plan.notes.emplace_back(
            "The Dockerfile of the project is not used: this server builds with its own.");
    if (project.compose)
        plan.notes.emplace_back(
            "The docker-compose.yml of the project is not used: this server runs its own.");
    impl_->projects.insert(plan.project);
    co_return plan;
}

result<core::DockerEnvironment> DockerMode::Impl::environment(LaunchSpec const& spec,
                                                              std::uint16_t port) const
{
    auto image = core::default_docker_image(params.images, spec.world_header);
    if (!image)
        return image.error();
    core::DockerEnvironment environment;
    environment.image = std::move(*image);
    environment.port = port;
    environment.project = concat(params.identity, "-", params.run, "-", spec.label);
    environment.server = params.identity;
    environment.world = spec.world.filename().string();
    environment.stream_mode = spec.mode;
    environment.display = params.display;
    environment.runtime = runtime;
    environment.graphics_device = params.graphics_device;
    return environment;
}

asio::awaitable<result<std::string>> DockerMode::Impl::read_template(std::string name)
{
    Arguments names{name};
    auto texts = co_await files.read(params.templates, std::move(names));
    if (!texts)
        co_return texts.error();
    if (!texts->front())
        co_return Failure(errc::not_found, concat("Missing ", name, " in ", params.templates.string()));
    co_return std::move(*texts->front());
}

/// The participant's controller runs outside of Webots, in a container that the project describes.
asio::awaitable<result<std::vector<TextFile>>> DockerMode::Impl::competition_files(LaunchSpec const& spec)
{
    auto const world = concat("worlds/", spec.world.filename().string());
    std::string const controller = "controllers/Dockerfile";
    Arguments names{world, controller};
    auto const texts = co_await files.read(spec.root, std::move(names));
    if (!texts)
        co_return texts.error();
    if (!texts->at(0) || !texts->at(1))
        co_return Failure(
            errc::not_found,
            "A competition needs a Dockerfile in its folder controllers, and the project has none.");
    std::vector<TextFile> added;
    added.emplace_back(world, core::with_extern_participant(*texts->at(0)));
    added.emplace_back(controller, core::with_server_label(*texts->at(1), params.identity));
    Arguments launcher{launcher_file};
    auto const ours = co_await files.read(params.templates, std::move(launcher));
    if (!ours)
        co_return ours.error();
    if (ours->front())
        added.emplace_back(launcher_file, *ours->front());
    co_return added;
}

ContainerPlan DockerMode::Impl::plan(LaunchSpec const& spec, core::DockerEnvironment const& environment) const
{
    auto const file = spec.root / "docker-compose.yml";
    ContainerPlan plan;
    plan.project = environment.project;
    plan.image = environment.image;
    plan.announcements = environment.yml.messages;
    plan.process = command(core::compose_up(compose, file));
    plan.process.directory = spec.root;
    plan.process.cleanup_command = core::compose_down(compose, file);
    if (environment.yml.kind == core::ComposeTemplate::competition)
        plan.restart_controller = command(core::compose_restart_controller(compose, file));
    return plan;
}

void DockerMode::forget(std::string const& project) noexcept
{
    impl_->projects.erase(project);
}

// --- after a simulation -------------------------------------------------------------------------------

asio::awaitable<void> DockerMode::clear(std::string project)
{
    core::DockerScope scope;
    scope.identity = impl_->params.identity;
    scope.project = project;
    auto const removed = co_await impl_->remove_leftovers(std::move(scope));
    if (!removed)
        impl_->log.error(LogCause("left-over"), concat("docker: of ", project, " something may be left: ",
                                                       removed.error().message()));
    impl_->projects.erase(project);
    if (impl_->cleared)
        impl_->cleared->notify();
    if (impl_->params.persistent_images)
        co_await impl_->remove_old_images();
}

asio::awaitable<result<>> DockerMode::run()
{
    impl_->cleared.emplace(co_await asio::this_coro::executor);
    for (;;) {
        auto const watched = co_await impl_->watch_builds();
        if (!watched)
            co_return watched;
        auto const woken = co_await impl_->cleared->wait();
        if (!woken)
            co_return woken;
    }
}

/// Looks until nothing is found.
asio::awaitable<result<>> DockerMode::Impl::remove_leftovers(core::DockerScope scope)
{
    for (int round = 0; round < max_rounds; ++round) {
        if (round > 0)
            (void)co_await clock.wait_until(clock.now() + between_rounds);
        auto const found = co_await remove_once(scope);
        if (!found)
            co_return found.error();
        if (*found == 0)
            co_return result<>();
        log.info(LogCause("left-overs"), concat("docker: removed ", std::to_string(*found), " left-overs of ",
                                                scope.project.empty() ? scope.identity : scope.project));
    }
    co_return Failure(errc::unavailable, "docker goes on showing what was removed");
}

/// When compose is killed in the middle of a build, docker may still make the container of the next step.
/// That of a build that lives has been started by the next look.
asio::awaitable<result<>> DockerMode::Impl::watch_builds()
{
    Arguments before;
    int quiet = 0;
    for (int look = 0; look < max_looks && quiet < quiet_looks; ++look) {
        auto const waited = co_await clock.wait_until(clock.now() + between_looks);
        if (!waited)
            co_return waited;
        auto const listing = co_await run(list_containers());
        auto const unstarted = core::unstarted_builds(listing ? *listing : std::string(), params.identity);
        Arguments still;
        std::copy_if(unstarted.begin(), unstarted.end(), std::back_inserter(still),
                     [&before](std::string const& id) {
                         return std::find(before.begin(), before.end(), id) != before.end();
                     });
        if (!still.empty())
            co_await remove_builds(std::move(still));
        quiet = unstarted.empty() ? quiet + 1 : 0;
        before = unstarted;
    }
    co_return result<>();
}

asio::awaitable<void> DockerMode::Impl::remove_builds(Arguments containers)
{
    log.info(LogCause("builds"), concat("docker: removes ", std::to_string(containers.size()),
                                        " containers of builds that were given up"));
    Arguments removal{params.docker.string(), "rm", "--force", "--volumes"};
    removal.insert(removal.end(), containers.begin(), containers.end());
    auto const removed = co_await run(std::move(removal));
    if (!removed)
        log.debug(concat("docker: ", removed.error().message()));
}

Arguments DockerMode::Impl::list_containers() const
{
    return {params.docker.string(), "ps", "--all", "--format", std::string(core::container_format)};
}

asio::awaitable<result<std::size_t>> DockerMode::Impl::remove_once(core::DockerScope const& scope)
{
    auto const docker = params.docker.string();
    // In this order: networks and volumes can't be removed while a container has them.
    Arguments remove_containers{docker, "rm", "--force", "--volumes"};
    auto const first = co_await remove_listed(list_containers(), std::move(remove_containers), scope);
    if (!first)
        co_return first;
    Arguments networks{docker, "network", "ls", "--format", std::string(core::network_format)};
    Arguments remove_networks{docker, "network", "rm"};
    auto const second = co_await remove_listed(std::move(networks), std::move(remove_networks), scope);
    if (!second)
        co_return second;
    Arguments volumes{docker, "volume", "ls", "--format", std::string(core::volume_format)};
    Arguments remove_volumes{docker, "volume", "rm", "--force"};
    auto const third = co_await remove_listed(std::move(volumes), std::move(remove_volumes), scope);
    if (!third)
        co_return third;
    co_return *first + *second + *third;
}

asio::awaitable<result<std::size_t>> DockerMode::Impl::remove_listed(Arguments list, Arguments removal,
                                                                     core::DockerScope const& scope)
{
    auto const listing = co_await run(std::move(list));
    if (!listing)
        co_return listing.error();
    auto const found = core::leftovers(*listing, scope);
    if (found.empty())
        co_return std::size_t{0};
    removal.insert(removal.end(), found.begin(), found.end());
    // What is being removed by somebody else (the guard of a dead predecessor) makes this fail: the next
    // round looks again.
    auto const removed = co_await run(std::move(removal));
    if (!removed)
        log.debug(concat("docker: ", removed.error().message()));
    co_return found.size();
}

asio::awaitable<void> DockerMode::Impl::remove_old_images()
{
    auto const docker = params.docker.string();
    Arguments images{docker, "images", "--format", std::string(core::image_format)};
    auto const listing = co_await run(std::move(images));
    if (!listing)
        co_return;
    core::ImagePolicy policy;
    policy.identity = params.identity;
    policy.repository = params.images;
    policy.persistent = *params.persistent_images;
    policy.projects = projects;
    for (auto const& image : core::old_images(*listing, policy, clock.wall())) {
        Arguments users{docker, "ps", "--quiet", "--filter", concat("ancestor=", image)};
        auto const used = co_await run(std::move(users));
        if (!used || !core::trim(*used).empty())
            continue;
        Arguments removal{docker, "rmi", image};
        auto const removed = co_await run(std::move(removal));
        log.info(removed ? concat("docker: removed the old image ", image)
                         : concat("docker: the old image ", image, " stays: ", removed.error().message()));
    }
}

} // namespace webots_cloud
