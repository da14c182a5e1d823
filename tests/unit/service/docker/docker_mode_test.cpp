#include "refusal_sentences.hpp"
#include "service/run.hpp"
#include "service/setups.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/docker/build_limits.hpp"
#include "core/docker/docker_leftovers.hpp"
#include "core/text.hpp"
#include "service/docker/docker_build_limits.hpp"
#include "service/docker/docker_commands.hpp"

#include <webots_cloud/docker_mode.hpp>
#include <webots_cloud/simulation_service.hpp>
#include <webots_cloud/testing/fixed_folder_meter.hpp>
#include <webots_cloud/testing/fixed_metrics.hpp>
#include <webots_cloud/testing/loopback_channel.hpp>
#include <webots_cloud/testing/memory_project_source.hpp>
#include <webots_cloud/testing/memory_text_files.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_processes.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::concat;
namespace asio = boost::asio;

// Protocol sections 6.3, 6.4, 6.5, 4.1.2 (step 9) and 4.1.3.
BOOST_AUTO_TEST_SUITE(docker_mode)

namespace {

using Texts = std::vector<std::string>;

constexpr auto start_message =
    R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"mjpeg"}})";
constexpr auto root = "/instances/1/project";
constexpr auto project = "webots-2000-1f3a9c4d-1-0123456789abcdef0123456789abcdef";
constexpr auto competition =
    "type: competition\ndockerCompose: competition:webots-project/controllers/participant/\n";

/// What is listed to find what is left: containers, networks, volumes and images.
constexpr int looks = 4;

/// A template that tells its name.
std::string compose_file(std::string const& name)
{
    return "# " + name + "\nservices:\n  webots:\n";
}

struct DockerSetup
{
    DockerConfig config;
    SimulationLauncherConfig launching;
    DockerFacts facts;
};

DockerSetup docker_setup()
{
    DockerSetup setup;
    setup.facts.docker = "/bin/docker";
    setup.facts.docker_compose = "/bin/docker-compose";
    setup.config.directory = "/templates";
    setup.config.build_cache = 0;
    setup.facts.identity = "webots-2000-1f3a9c4d";
    setup.facts.environment = {{"PATH", "/bin"}, {"SECRET", "x"}, {"LAB_HOST", "h"}};
    setup.launching.simulator_environment = {"LAB_*", "ROS_DOMAIN_ID=7"};
    return setup;
}

DockerModeHooks docker_hooks()
{
    DockerModeHooks hooks;
    hooks.new_token = [] { return std::string("0123456789abcdef0123456789abcdef"); };
    return hooks;
}

LauncherSetup launcher_setup(std::uint64_t disk)
{
    LauncherSetup setup;
    setup.facts.limits.disk = disk;
    setup.config.max_simulations = 2;
    setup.config.timeout = 6000s;
    setup.config.start_timeout = 300s;
    return setup;
}

ServiceSetup service_setup()
{
    ServiceSetup setup;
    setup.facts.walls.containers = true;
    setup.facts.address.host = "host.org";
    setup.facts.address.ssl = false;
    setup.facts.address.port_rewrite = false;
    setup.config.repositories.allowed = {"https://github.com/o"};
    return setup;
}

SimulationServiceHooks service_hooks(FolderMeter& meter)
{
    SimulationServiceHooks hooks;
    hooks.folder_meter = &meter;
    return hooks;
}

ProjectFetcherParams fetcher_params()
{
    ProjectFetcherParams params;
    params.instances = "/instances";
    return params;
}

std::string joined(Texts const& argv)
{
    std::string text;
    for (auto const& argument : argv)
        text += text.empty() ? argument : " " + argument;
    return text;
}

/// A simulation server that runs containers, on fakes. At its end nothing may be left.
struct Fixture
{
    explicit Fixture(DockerSetup const& setup = docker_setup(), DockerModeHooks hooks = docker_hooks(),
                     std::uint64_t disk = 0)
        : docker(setup.config, setup.launching, setup.facts, processes, files, world.clock, log.logger(),
                 std::move(hooks)),
          fetcher(fetcher_params(), {Forge("https://github.com", source)}, log.logger()),
          launcher(launcher_setup(disk).config, launcher_setup(disk).facts, processes, world.clock,
                   log.logger(), &docker),
          service(service_setup().config, service_setup().facts, fetcher, launcher, metrics, world.clock,
                  log.logger(), service_hooks(meter))
    {
        for (std::string const name :
             {"docker-compose-default.yml", "docker-compose-theia.yml", "docker-compose-competition.yml"})
            files.texts["/templates/" + name] = compose_file(name);
        files.texts["/templates/Dockerfile.default"] = "Dockerfile.default";
        source.add("o/r", "a.wbt");
    }

    ~Fixture()
    {
        world.run(background.end());
        BOOST_TEST(browsings.size() == 0u);
        BOOST_TEST(processes.alive() == 0);
        BOOST_TEST(processes.held() == 0u);
        BOOST_TEST(launcher.running() == 0u);
        BOOST_TEST(source.directories().empty());
        BOOST_TEST(world.clock.pending() == 0u);
    }

    /// Programs that succeed at once.
    void expect_commands(int count, std::string output = {})
    {
        for (int i = 0; i < count; ++i)
            processes.expect().prints(output).exits(0);
    }

    /// Opens docker mode of a machine where nothing is left, with `docker compose`.
    void open()
    {
        expect_commands(1, "Docker Compose version v2\n");
        expect_commands(1, "Docker 26.1.5 has io.containerd.runc.v2 runc \n");
        expect_commands(looks);
        BOOST_TEST_REQUIRE(world.run(docker.open()).has_value());
        opened = processes.started().size();
    }

    testing::LoopbackChannel& start(std::string message = start_message)
    {
        auto& browser = *browsers.emplace_back(std::make_unique<testing::LoopbackChannel>(world.executor()));
        ChannelInfo info;
        info.path = "/client";
        browsings.spawn(service.serve_websocket(std::move(info), browser));
        browser.browser_says(std::move(message));
        world.settle();
        return browser;
    }

    void leave(testing::LoopbackChannel& browser)
    {
        browser.browser_leaves();
        world.settle();
    }

    /// Of the project.
    std::string& file(std::string const& name) { return files.texts[concat(root, "/", name)]; }

    void has_competition(std::string dockerfile)
    {
        file("webots.yml") = competition;
        file("worlds/a.wbt") = "";
        file("controllers/Dockerfile") = std::move(dockerfile);
    }

    asio::awaitable<void> run_docker()
    {
        auto const ended = co_await docker.run();
        BOOST_TEST(ended.error().code() == asio::error::operation_aborted);
    }

    /// Commands run since docker mode was opened.
    Texts run() const
    {
        Texts lines;
        for (auto i = opened; i < processes.started().size(); ++i)
            lines.push_back(joined(processes.started()[i].argv));
        return lines;
    }

    /// Whether a command was run, whatever was run before and after it. One that ends with a blank had more
    /// arguments, which do not matter.
    boost::test_tools::assertion_result has_run(std::string_view command) const
    {
        Texts lines;
        for (auto const& each : processes.started())
            lines.push_back(joined(each.argv));
        boost::test_tools::assertion_result found(std::ranges::any_of(lines, [&](auto const& line) {
            return command.ends_with(' ') ? line.starts_with(command) : line == command;
        }));
        for (auto const& line : lines)
            found.message() << "\n  was run: " << line;
        return found;
    }

    /// How many commands had these words in a row, since docker mode was opened.
    std::ptrdiff_t runs_of(std::string_view words) const
    {
        return std::ranges::count_if(run(),
                                     [&](auto const& line) { return line.find(words) != std::string::npos; });
    }

    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedProcesses processes{world.clock};
    testing::MemoryTextFiles files;
    testing::MemoryProjectSource source{world.clock};
    testing::FixedMetrics metrics;
    testing::FixedFolderMeter meter;
    DockerMode docker;
    ProjectFetcher fetcher;
    SimulationLauncher launcher;
    SimulationService service;
    std::size_t opened = 0;
    std::vector<std::unique_ptr<testing::LoopbackChannel>> browsers;
    async::TaskGroup browsings{world.executor()};
    async::TaskGroup background{world.executor()}; ///< What runs until the end.
};

std::string said_by_open(Fixture& fixture)
{
    auto const opened = fixture.world.run(fixture.docker.open());
    return opened ? "" : opened.error().message();
}

std::ptrdiff_t errors_told(testing::LoopbackChannel const& browser)
{
    return std::count_if(browser.sent.begin(), browser.sent.end(),
                         [](std::string const& text) { return text.starts_with("loading: Error: "); });
}

} // namespace

BOOST_AUTO_TEST_CASE(compose_as_a_part_of_docker_is_preferred)
{
    Fixture fixture;
    fixture.open();
    BOOST_TEST(fixture.log.contains("Simulations run in containers, by /bin/docker compose and runc"));
    BOOST_TEST(fixture.log.contains("Builds of projects may use Docker's own list of system calls"));
    BOOST_TEST(fixture.has_run("/bin/docker compose version"));
    for (std::string const left : {"ps --all", "network ls", "volume ls", "images"})
        BOOST_TEST(fixture.has_run("/bin/docker " + left + " --format "));
}

BOOST_AUTO_TEST_CASE(compose_as_a_program_of_its_own_will_do)
{
    Fixture fixture;
    fixture.processes.expect().prints("docker: 'compose' is not a docker command.\n").exits(1);
    fixture.expect_commands(1, "docker-compose version 1.29.2\n");
    fixture.expect_commands(1, "Docker 20.10.24 has nvidia runc with name=seccomp,profile=/etc/x.json \n");
    fixture.expect_commands(looks);
    BOOST_TEST(said_by_open(fixture) == "");
    BOOST_TEST(fixture.log.contains("Simulations run in containers, by /bin/docker-compose and nvidia"));
    BOOST_TEST(!fixture.log.contains("Builds of projects"));
}

BOOST_AUTO_TEST_CASE(what_is_missing_is_said_to_the_operator)
{
    {
        auto setup = docker_setup();
        setup.facts.docker.clear();
        Fixture fixture(setup);
        BOOST_TEST(said_by_open(fixture) ==
                   "docker: there is no program \"docker\". Install Docker, or set \"docker\" to false.");
    }
    {
        Fixture fixture;
        fixture.processes.expect().exits(1);
        fixture.processes.expect().exits(1);
        BOOST_TEST(said_by_open(fixture).starts_with(
            "docker: neither \"docker compose\" nor \"docker-compose\" can be run."));
    }
    {
        Fixture fixture;
        fixture.expect_commands(1);
        fixture.processes.expect().prints("Cannot connect to the Docker daemon at unix:///x.\n").exits(1);
        BOOST_TEST(said_by_open(fixture) ==
                   "docker: the daemon does not answer: Cannot connect to the Docker daemon at unix:///x.");
    }
    {
        Fixture fixture;
        fixture.expect_commands(1);
        fixture.expect_commands(1,
                                "Docker  has \nWARNING: No swap limit support\n"); // with exit status 0
        BOOST_TEST(said_by_open(fixture) ==
                   "docker: the daemon does not answer: Is it running, and may this user use it?");
    }
}

BOOST_AUTO_TEST_CASE(a_daemon_that_never_answers_is_given_up_after_a_minute)
{
    Fixture fixture;
    fixture.expect_commands(1);
    fixture.processes.expect();
    BOOST_TEST(said_by_open(fixture).starts_with("docker: the daemon does not answer: "));
}

// Protocol 6.1: `xhost +local:root`.
BOOST_AUTO_TEST_CASE(containers_are_let_on_to_the_screen_once_and_do_without_if_need_be)
{
    for (int const status : {0, 1}) {
        auto setup = docker_setup();
        setup.facts.xhost = "/bin/xhost";
        setup.facts.display = ":3";
        Fixture fixture(setup);
        fixture.expect_commands(2, "Docker 26.1.5 has runc \n");
        fixture.processes.expect().exits(status);
        fixture.expect_commands(looks);
        BOOST_TEST(said_by_open(fixture) == "");
        auto const& xhost = fixture.processes.started().at(2);
        BOOST_TEST(joined(xhost.argv) == "/bin/xhost +local:root");
        std::pair<std::string, std::string> const display("DISPLAY", ":3");
        BOOST_TEST(std::count(xhost.environment.begin(), xhost.environment.end(), display) == 1);
        BOOST_TEST(fixture.log.contains("Containers can't use the screen :3: ") == (status != 0));
    }
}

BOOST_AUTO_TEST_CASE(what_a_dead_predecessor_left_is_removed_until_nothing_is_found)
{
    Fixture fixture;
    fixture.expect_commands(2, "Docker 26.1.5 has runc \n");
    fixture.expect_commands(
        1, "c1\t\"webots-2000-1f3a9c4d-old-1\"\t\"\"\tUp 3 seconds\nc2\t\"blog\"\t\"\"\tUp 3 days\n");
    fixture.expect_commands(1);
    fixture.expect_commands(1, "n1\t\"webots-2000-1f3a9c4d-old-1\"\nn2\t\"blog\"\n");
    fixture.processes.expect().prints("somebody else has removed it\n").exits(1);
    fixture.expect_commands(1);
    fixture.expect_commands(1, "webots-2000-1f3a9c4d-1-0_webots:latest\tnow\ndebian:12\tnow\n");
    fixture.expect_commands(1 + looks);
    BOOST_TEST(said_by_open(fixture) == "");
    BOOST_TEST(fixture.has_run("/bin/docker rm --force --volumes c1"));
    BOOST_TEST(fixture.has_run("/bin/docker network rm n1"));
    BOOST_TEST(fixture.has_run("/bin/docker rmi --force --no-prune webots-2000-1f3a9c4d-1-0_webots:latest"));
}

BOOST_AUTO_TEST_CASE(a_simulation_is_told_in_the_order_that_browsers_rely_on)
{
    Fixture fixture;
    fixture.open();
    fixture.file("webots.yml") = "type: demo\ndockerCompose:theia:webots-project/controllers/\n";
    fixture.file("webots.yaml") = "type: other\n"; // where there are both, the first counts
    fixture.file("Makefile") = "all:\n";
    fixture.processes.expect()
        .prints("Creating network \"x_default\"\r\n\r\nStep 1/9 : ARG A\nPulling theia\n./configure\n")
        .prints("webots_1  | Loading\r\nwebots_1  | .\r\n")
        .after(5s)
        .prints("webots_1  | .\nStep 2/9\ntheia_1 | .\n");
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.world.advance(5s);
    BOOST_TEST(browser.sent == (Texts{"type:demo\n", "ide: enable", "shutdownTimeout: 6000",
                                      "loading: Creating network \"x_default\"", "loading: Step 1/9 : ARG A",
                                      "loading: Loading", "webots:ws://host.org:2001", "."}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.file("docker-compose.yml") == compose_file("docker-compose-theia.yml"));
    BOOST_TEST(fixture.file("Dockerfile") ==
               "Dockerfile.default\nLABEL webots_cloud.server=webots-2000-1f3a9c4d\n");
    BOOST_TEST(fixture.file(".env").find(
                   concat("\nMAKE=1\nPORT=2001\nCOMPOSE_PROJECT_NAME=", project, "\n")) != std::string::npos);
    BOOST_TEST(fixture.file(".env").ends_with("THEIA_VOLUME=webots-project/controllers/\nTHEIA_PORT=2501\n"));
    auto const up = fixture.processes.started().at(fixture.opened);
    BOOST_TEST(joined(up.argv) == "/bin/docker compose -f /instances/1/project/docker-compose.yml -f "
                                  "/instances/1/project/docker-compose.walls.yml up --build --no-color");
    BOOST_TEST(joined(up.cleanup_command) ==
               "/bin/docker compose -f /instances/1/project/docker-compose.yml -f "
               "/instances/1/project/docker-compose.walls.yml down -v --timeout 0");
    BOOST_TEST(std::none_of(up.environment.begin(), up.environment.end(),
                            [](auto const& variable) { return variable.first == "SECRET"; }));
    for (auto const& listed : {std::pair<std::string, std::string>("LAB_HOST", "h"), {"ROS_DOMAIN_ID", "7"}})
        BOOST_TEST(std::count(up.environment.begin(), up.environment.end(), listed) == 1, listed.first);
    fixture.leave(browser);
    BOOST_TEST(fixture.run().size() == 1u + looks);
}

// Protocol 6.1; quirk Q22.
BOOST_AUTO_TEST_CASE(the_webots_of_the_image_decides_what_it_calls_the_scene_mode)
{
    Fixture fixture;
    fixture.open();
    fixture.source.add("o/r", "a.wbt", "#VRML_SIM R2023a utf8");
    fixture.processes.expect();
    fixture.expect_commands(looks);
    auto& browser =
        fixture.start(R"({"start":{"url":"https://github.com/o/r/blob/main/worlds/a.wbt","mode":"w3d"}})");
    BOOST_TEST(
        fixture.file(".env").find(" --minimize --no-rendering --port=2001 --heartbeat=5000 --stream /usr/") !=
            std::string::npos,
        fixture.file(".env"));
    fixture.leave(browser);
}

// Protocol 4.1.2 step 3: the load of the last second decides and not the mean.
BOOST_AUTO_TEST_CASE(idle_time_is_shared_while_the_last_second_was_idle)
{
    Fixture fixture;
    fixture.open();
    fixture.source.add("x/r", "a.wbt");
    auto setup = service_setup();
    setup.config.repositories.blocked = {"https://github.com/evil", "https://github.com/y/r/blob/main/p"};
    setup.config.repositories.share_idle_time = 50;
    fixture.service.apply(setup.config);
    fixture.background.spawn(webots_cloud::run(fixture.service));
    fixture.world.advance(4s);
    fixture.metrics.cpu = 100;
    fixture.world.advance(1s);
    BOOST_TEST(fixture.service.load() == 20);
    constexpr auto strangers = R"({"start":{"url":"https://github.com/x/r/blob/main/worlds/a.wbt"}})";
    auto& refused = fixture.start(strangers);
    BOOST_TEST(
        refused.sent ==
            (Texts{"loading: Error: Cannot share idle time when current load is above threshold: 100.0."}),
        boost::test_tools::per_element());
    fixture.world.advance(4s);
    fixture.metrics.cpu = 0;
    fixture.world.advance(1s);
    BOOST_TEST(fixture.service.load() == 80);
    auto& blocked = fixture.start(R"({"start":{"url":"https://github.com/evil/r/blob/main/worlds/a.wbt"}})");
    BOOST_TEST(blocked.was_told("loading: Error: Cannot run simulation from blocked repository: "));
    fixture.source.refs = RefMeaning::none; // as of a plain folder
    auto& same_folder =
        fixture.start(R"({"start":{"url":"https://github.com/y/r/blob/other/p/worlds/a.wbt"}})");
    BOOST_TEST(same_folder.was_told("loading: Error: Cannot run simulation from blocked repository: "));
    fixture.processes.expect().prints("webots-1  | .\n");
    fixture.expect_commands(looks);
    auto& accepted = fixture.start(strangers);
    BOOST_TEST(accepted.was_told("webots:"));
    fixture.leave(accepted);
}

BOOST_AUTO_TEST_CASE(the_names_of_newer_containers_are_known_too)
{
    for (auto const& prefix : {std::string("webots-1  | "), concat(project, "-webots-1  | ")}) {
        Fixture fixture;
        fixture.open();
        fixture.processes.expect()
            .prints("controller-1  | .\n")
            .after(1s)
            .prints(prefix + ".\n" + prefix + "real-time\n");
        fixture.expect_commands(looks);
        auto& browser = fixture.start();
        BOOST_TEST(!browser.was_told("webots:"));
        fixture.world.advance(1s);
        BOOST_TEST(browser.was_told("webots:"));
        fixture.leave(browser);
    }
}

// Compose prints the names of images and containers, from which anybody's build could take files.
BOOST_AUTO_TEST_CASE(no_browser_hears_the_name_of_a_simulation)
{
    Fixture fixture;
    fixture.open();
    auto const name = std::string(project);
    fixture.processes.expect()
        .prints("Creating network \"" + name + "_default\"\nSuccessfully tagged " + name + "_webots:latest\n")
        .after(1s)
        .prints("ERROR: for " + name + "_webots_1 no such runtime\n")
        .exits(1);
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.was_told("loading: Creating network \"simulation_default\""));
    BOOST_TEST(browser.was_told("loading: Successfully tagged simulation_webots:latest"));
    BOOST_TEST(browser.sent.back() ==
               error_line(core::Refused::ended_early_saying,
                          {{"how", "it exited with status 1"},
                           {"words", "ERROR: for simulation_webots_1 no such runtime"}}));
    for (auto const& text : browser.sent)
        BOOST_TEST(text.find("0123456789abcdef") == std::string::npos, text);
}

BOOST_AUTO_TEST_CASE(a_step_of_a_build_that_was_given_up_is_removed_when_it_is_not_started)
{
    Fixture fixture;
    fixture.open();
    constexpr auto step = "b1\t\"\"\t\"webots-2000-1f3a9c4d\"\t";
    fixture.expect_commands(1, std::string(step) + "Created\n");
    fixture.expect_commands(1, std::string(step) + "Created\nb2\t\"\"\t\"webots-2000-1f3a9c4d\"\tCreated\n");
    fixture.expect_commands(1); // the removal
    fixture.expect_commands(1, "b2\t\"\"\t\"webots-2000-1f3a9c4d\"\tUp 3 seconds\n");
    fixture.expect_commands(1);
    fixture.background.spawn(fixture.run_docker());
    fixture.world.advance(60s);
    BOOST_TEST(fixture.run().size() == 5u); // nothing more until a simulation ends
    BOOST_TEST(fixture.has_run("/bin/docker rm --force --volumes b1"));
}

BOOST_AUTO_TEST_CASE(what_is_left_while_docker_does_not_answer_is_removed_when_it_does)
{
    Fixture fixture;
    fixture.open();
    fixture.expect_commands(2);
    fixture.background.spawn(fixture.run_docker());
    fixture.world.advance(60s);
    fixture.processes.expect().prints("webots-1  | .\n");
    for (int i = 0; i < 5; ++i) // what is left, two looks at builds, late names, what is left
        fixture.processes.expect().prints("Cannot connect to the Docker daemon.\n").exits(1);
    fixture.expect_commands(2);
    fixture.expect_commands(1, concat("c1\t\"", project, "\"\t\"\"\tExited (137) 1 second ago\n"));
    fixture.expect_commands(1 + 3 + looks);
    fixture.leave(fixture.start());
    BOOST_TEST(fixture.log.contains("something may be left, until docker answers: Cannot connect"));
    fixture.world.advance(60s);
    BOOST_TEST(fixture.run().size() == 3u + 5u + 2u + 1u + 1u + 3u + looks);
    BOOST_TEST(fixture.has_run("/bin/docker rm --force --volumes c1"));
}

BOOST_AUTO_TEST_CASE(each_step_of_a_build_is_limited_as_soon_as_it_runs)
{
    auto setup = docker_setup();
    setup.facts.limits.processes = 50;
    Fixture fixture(setup);
    fixture.open();
    fixture.file("Makefile") = "all:\n";
    fixture.expect_commands(2); // looks at builds
    fixture.background.spawn(fixture.run_docker());
    fixture.world.advance(60s);
    fixture.processes.expect().after(10s).prints("webots-1  | .\n");
    fixture.processes
        .expect() // docker events
        .after(1s)
        .prints("0a\t\"\"\n0b\t\"webots-2000-1f3a9c4d-1-0\"\n0c")
        .after(1s)
        .prints("\t\"\"\n")
        .after(1s)
        .exits(1);
    fixture.processes.expect().prints("No such container: 0a\n").exits(1);
    fixture.expect_commands(1);
    fixture.processes.expect(); // docker events again
    fixture.expect_commands(looks + 3);
    auto& browser = fixture.start();
    fixture.world.advance(20s);
    fixture.leave(browser);
    fixture.world.advance(60s);
    BOOST_TEST(fixture.run().size() == 2u + 1u + 4u + looks + 3u);
    BOOST_TEST(fixture.runs_of("docker events --since") == 2);
    BOOST_TEST(fixture.has_run("/bin/docker update --pids-limit 50 0a"));
    BOOST_TEST(fixture.has_run("/bin/docker update --pids-limit 50 0c"));
    BOOST_TEST(fixture.processes.alive() == 0);
}

// The names of projects end with the numbers of their simulations, of which 10 is before 9.
BOOST_AUTO_TEST_CASE(docker_is_asked_for_the_steps_of_the_build_that_began_first)
{
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedProcesses processes(world.clock);
    auto setup = docker_setup();
    setup.facts.limits.processes = 50;
    DockerCommands const commands(setup.launching, setup.facts, processes, world.clock);
    DockerBuildLimits limits(setup.facts, commands, processes, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    processes.expect();
    auto const first = world.clock.wall();
    limits.begin("webots-9");
    world.advance(5s);
    limits.begin("webots-10");
    tasks.spawn(run(limits));
    world.settle();
    auto expected = core::watch_starts(setup.facts.identity, first);
    expected.insert(expected.begin(), setup.facts.docker.string());
    BOOST_TEST_REQUIRE(processes.started().size() == 1u);
    BOOST_TEST(processes.started().front().argv == expected, boost::test_tools::per_element());
    tasks.cancel_all();
    world.run(tasks.join());
}

/// As docker numbers images.
std::string image_id(char digit)
{
    return concat("sha256:", std::string(64, digit));
}

BOOST_AUTO_TEST_CASE(all_steps_of_a_build_together_may_write_as_much_as_a_simulation)
{
    Fixture fixture(docker_setup(), docker_hooks(), 10'000'000);
    fixture.open();
    fixture.processes.expect().prints("Step 1/9 : FROM x\n ---> aaaaaaaaaaaa\n ---> bbbbbbbbbbbb\n"
                                      " ---> Running in cccccccccccc\n");
    auto const ids = concat(image_id('a'), "\n", image_id('b'), "\n", image_id('d'), "\n");
    auto const images =
        concat(image_id('a'), "\t\t900000000\t1\n", image_id('b'), "\t", image_id('a'), "\t906000000\t2\n");
    for (auto const* step :
         {"cccccccccccc\t3.9MB (virtual 910MB)\n", "cccccccccccc\t4.1MB (virtual 910MB)\n"}) {
        fixture.expect_commands(1); // no containers
        fixture.expect_commands(1, ids);
        fixture.expect_commands(1, images);
        fixture.expect_commands(1, step);
    }
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.background.spawn(webots_cloud::run(fixture.service));
    fixture.world.advance(1s);
    BOOST_TEST(!browser.close_code.has_value());
    fixture.world.advance(3s);
    BOOST_TEST(fixture.run().size() == 1u + 2 * 4u + looks);
    BOOST_TEST(fixture.has_run("/bin/docker images --all --quiet --no-trunc"));
    BOOST_TEST(fixture.runs_of(concat(" ", image_id('a'), " ", image_id('b'))) == 2);
    BOOST_TEST(fixture.runs_of(" --filter id=cccccccccccc") == 2);
    BOOST_TEST(
        browser.sent.back() ==
        "loading: Error: The steps that build the project made images of more than 9 MB together, which "
        "is the limit of a simulation on this server. Its operator can raise \"simulationDisk\".");
}

BOOST_AUTO_TEST_CASE(what_was_built_is_counted_once_more_when_the_containers_are_there_and_not_again)
{
    Fixture fixture(docker_setup(), docker_hooks(), 10'000'000);
    fixture.open();
    fixture.processes.expect().prints(" ---> bbbbbbbbbbbb\nwebots-1  | .\n");
    constexpr auto containers = "1MB (virtual 1GB)\t\n";
    fixture.expect_commands(1, containers);
    fixture.processes.expect().prints("Cannot connect to the Docker daemon.\n").exits(1);
    fixture.expect_commands(1, containers);
    fixture.expect_commands(1, image_id('b'));
    fixture.expect_commands(1, concat(image_id('b'), "\t\t1\t2\n"));
    fixture.expect_commands(1);
    fixture.expect_commands(1, containers);
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.background.spawn(webots_cloud::run(fixture.service));
    fixture.world.advance(25s);
    BOOST_TEST(fixture.run().size() == 1u + 2u + 4u + 1u);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_build_that_names_more_than_any_build_makes_is_ended)
{
    Fixture fixture(docker_setup(), docker_hooks(), 10'000'000);
    fixture.open();
    std::string flood;
    for (int number = 0; number <= 2000; ++number)
        flood += concat(" ---> ", std::to_string(100'000'000'000 + number), "\n");
    fixture.processes.expect().prints(flood);
    fixture.expect_commands(1 + looks);
    auto& browser = fixture.start();
    fixture.background.spawn(webots_cloud::run(fixture.service));
    fixture.world.advance(1s);
    BOOST_TEST(
        browser.sent.back().starts_with("loading: Error: The steps that build the project made images "),
        browser.sent.back());
}

BOOST_AUTO_TEST_CASE(what_is_kept_of_builds_has_a_limit_and_nothing_goes_that_a_running_build_has_named)
{
    auto setup = docker_setup();
    setup.config.build_cache = 1 << 20;
    Fixture fixture(setup);
    fixture.open();
    fixture.processes.expect().prints(" ---> cccccccccccc\nwebots-1  | .\n");
    fixture.processes.expect().prints("webots-1  | .\n");
    fixture.expect_commands(looks);
    fixture.expect_commands(1, concat(image_id('a'), "\n", image_id('b'), "\n", image_id('c'), "\n"));
    fixture.expect_commands(1, concat(image_id('a'), "\t\t900000000\t1\n", image_id('b'), "\t", image_id('a'),
                                      "\t902000000\t2\n", image_id('c'), "\t", image_id('a'),
                                      "\t902000000\t1\n"));
    fixture.processes.expect().prints("conflict: unable to delete\n").exits(1);
    fixture.start();
    auto& browser = fixture.start();
    fixture.leave(browser);
    BOOST_TEST(fixture.run().size() == 2u + looks + 3u);
    BOOST_TEST(fixture.has_run("/bin/docker images --all --quiet --no-trunc --filter "
                               "label=webots_cloud.server=webots-2000-1f3a9c4d"));
    BOOST_TEST(fixture.has_run(concat("/bin/docker rmi --no-prune ", image_id('b'))));
    BOOST_TEST(fixture.log.contains("docker: removes 1 images of builds, since those that are kept take more "
                                    "than 1 MB (\"buildCache\")"));
    fixture.expect_commands(looks);
    fixture.expect_commands(1); // nothing is kept
    fixture.leave(*fixture.browsers.front());
}

BOOST_AUTO_TEST_CASE(docker_is_not_followed_for_a_project_that_has_nothing_run)
{
    auto setup = docker_setup();
    setup.facts.limits.processes = 50;
    Fixture fixture(setup);
    fixture.open();
    fixture.expect_commands(2);
    fixture.background.spawn(fixture.run_docker());
    fixture.world.advance(60s);
    fixture.processes.expect().prints("webots-1  | .\n");
    fixture.expect_commands(looks + 3);
    fixture.leave(fixture.start());
    fixture.world.advance(60s);
    BOOST_TEST(fixture.run().size() == 2u + 1u + looks + 3u);
}

// So that nobody can start an image from it.
BOOST_AUTO_TEST_CASE(after_a_simulation_builds_are_watched_again_and_lose_the_names_that_they_get_late)
{
    Fixture fixture;
    fixture.open();
    fixture.expect_commands(2);
    fixture.background.spawn(fixture.run_docker());
    fixture.world.advance(60s);
    fixture.processes.expect().prints("webots-1  | .\n");
    fixture.expect_commands(looks + 2);
    fixture.expect_commands(1,
                            concat(project, "_webots:latest\t2026-11-28 12:00:00 +0000 UTC\n",
                                   "webots-2000-1f3a9c4d-2-0_webots:latest\t2026-11-28 12:00:00 +0000 UTC\n",
                                   "other:latest\t2026-11-28 12:00:00 +0000 UTC\n"));
    fixture.expect_commands(1);
    auto& browser = fixture.start();
    fixture.leave(browser);
    fixture.world.advance(60s);
    BOOST_TEST(fixture.run().size() == 2u + 1u + looks + 2u + 2u);
    BOOST_TEST(fixture.has_run(concat("/bin/docker rmi --force --no-prune ", project, "_webots:latest")));
}

BOOST_AUTO_TEST_CASE(a_template_whose_services_cannot_be_found_is_not_run_without_walls)
{
    Fixture fixture;
    fixture.open();
    fixture.files.texts["/templates/docker-compose-default.yml"] = "services: {webots: {image: x}}\n";
    auto& browser = fixture.start();
    BOOST_TEST_REQUIRE(browser.sent.size() == 1u);
    BOOST_TEST(browser.sent.front().starts_with(
        "loading: Error: This server's docker-compose-default.yml has no services that can be understood."));
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(what_containers_write_counts_towards_the_limit_of_the_disk)
{
    Fixture fixture(docker_setup(), docker_hooks(), 10'000'000);
    fixture.open();
    fixture.meter.use.bytes = 4'000'000;
    fixture.processes.expect().prints("webots-1  | .\n");
    fixture.expect_commands(1, "5.5MB (virtual 1GB)\t/tmp/.X11-unix\n");
    fixture.expect_commands(1, "6.1MB (virtual 1GB)\t\n");
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.background.spawn(webots_cloud::run(fixture.service));
    fixture.world.advance(9s);
    BOOST_TEST(fixture.run().size() == 2u); // docker counts for long
    BOOST_TEST(!browser.close_code.has_value());
    fixture.world.advance(3s);
    BOOST_TEST(fixture.has_run(concat(
        "/bin/docker ps --all --no-trunc --size --filter label=com.docker.compose.project=", project, " ")));
    BOOST_TEST(browser.sent.back().starts_with(
                   "loading: Error: The simulation filled its folder with more than 9 MB, "),
               browser.sent.back());
    BOOST_TEST(browser.close_code.has_value());
}

BOOST_AUTO_TEST_CASE(what_lies_in_volumes_counts_too_and_a_docker_that_does_not_answer_ends_nothing)
{
    Fixture fixture;
    fixture.open();
    fixture.expect_commands(1, "1MB (virtual 1GB)\tvolume1,volume2\n");
    fixture.processes.expect().after(2s).prints("volume1\t2MB\nother\t1GB\nvolume2\t500kB\n").exits(0);
    BOOST_TEST(fixture.world.run(fixture.docker.written(project)).files == 3'500'000u);
    BOOST_TEST(fixture.has_run("/bin/docker system df --verbose --format "));
    fixture.world.advance(19s); // it takes long: not so often
    BOOST_TEST(fixture.world.run(fixture.docker.written(project)).files == 3'500'000u);
    BOOST_TEST(fixture.run().size() == 2u);
    fixture.processes.expect().prints("Cannot connect to the Docker daemon.\n").exits(1);
    BOOST_TEST(fixture.world.run(fixture.docker.written("other")).files == 0u);
}

BOOST_AUTO_TEST_CASE(the_operators_list_of_system_calls_lies_beside_the_project)
{
    Fixture fixture;
    fixture.open();
    fixture.files.texts["/templates/seccomp.json"] = "{}";
    fixture.processes.expect().prints("webots-1  | .\n");
    fixture.expect_commands(looks + 2);
    fixture.leave(fixture.start());
    BOOST_TEST(fixture.file("docker-compose.seccomp.json") == "{}");
    BOOST_TEST(fixture.file("docker-compose.walls.yml").find("- seccomp:docker-compose.seccomp.json\n") !=
               std::string::npos);
}

// An image can have any labels of compose's.
BOOST_AUTO_TEST_CASE(the_container_that_gets_the_network_is_known_by_a_label_that_nobody_guesses)
{
    auto setup = docker_setup();
    setup.facts.network.reach = ProcessNetwork::Reach::none;
    Fixture fixture(setup);
    fixture.open();
    fixture.processes.expect().prints("webots-1  | .\n");
    fixture.expect_commands(looks);
    fixture.leave(fixture.start());
    auto const& container = fixture.processes.started().at(fixture.opened).container;
    BOOST_TEST(container.docker == "/bin/docker");
    BOOST_TEST(container.label == "webots_cloud.simulator=0123456789abcdef0123456789abcdef");
    BOOST_TEST(fixture.file("docker-compose.walls.yml")
                   .find("webots_cloud.simulator: \"0123456789abcdef0123456789abcdef\"\n") !=
               std::string::npos);
}

BOOST_AUTO_TEST_CASE(the_socket_of_the_display_is_shown_while_it_is_there)
{
    for (bool const there : {false, true}) {
        auto setup = docker_setup();
        setup.facts.display = ":3";
        auto hooks = docker_hooks();
        hooks.exists = [there](std::filesystem::path const& path) {
            return there && path == "/tmp/.X11-unix/X3";
        };
        Fixture fixture(setup, hooks);
        fixture.open();
        fixture.files.texts["/templates/docker-compose-default.yml"] =
            "services:\n  webots:\n    volumes:\n      - /tmp/.X11-unix:/tmp/.X11-unix\n";
        fixture.processes.expect().prints("webots-1  | .\n");
        fixture.expect_commands(looks + 2);
        fixture.leave(fixture.start());
        auto const& walls = fixture.file("docker-compose.walls.yml");
        BOOST_TEST(walls.find("target: /tmp/.X11-unix\n") != std::string::npos);
        BOOST_TEST((walls.find("source: /tmp/.X11-unix/X3\n") != std::string::npos) == there);
    }
}

BOOST_AUTO_TEST_CASE(a_missing_template_is_named)
{
    for (std::string const name : {"docker-compose-default.yml", "Dockerfile.default"}) {
        Fixture fixture;
        fixture.open();
        fixture.files.texts.erase("/templates/" + name);
        auto& browser = fixture.start();
        BOOST_TEST(browser.sent == (Texts{"loading: Error: Missing " + name + " in /templates"}),
                   boost::test_tools::per_element());
        BOOST_TEST(browser.close_code.has_value());
    }
}

BOOST_AUTO_TEST_CASE(a_line_with_too_few_fields_is_answered_with_a_sentence)
{
    Fixture fixture;
    fixture.open();
    fixture.file("webots.yaml") = "dockerCompose:theia\n";
    auto& browser = fixture.start();
    BOOST_TEST_REQUIRE(browser.sent.size() == 1u);
    BOOST_TEST(browser.sent.front().starts_with(
        "loading: Error: Wrong line in webots.yml: \"dockerCompose:theia\"."));
}

BOOST_AUTO_TEST_CASE(an_image_that_does_not_exist_is_told_in_the_words_that_browsers_know)
{
    Fixture fixture;
    fixture.open();
    fixture.processes.expect()
        .prints("manifest for cyberbotics/webots.cloud:R2025a-ubuntu22.04 not found\n")
        .after(1s)
        .exits(1);
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    BOOST_TEST(errors_told(browser) == 1);
    BOOST_TEST(browser.sent.back() ==
               "loading: Error: Image version R2025a not available on Cyberbotics' dockerHub. Please, add "
               "the appropriate Dockerfile to your project.");
}

BOOST_AUTO_TEST_CASE(files_of_the_project_are_replaced_and_the_browser_is_told)
{
    Fixture fixture;
    fixture.open();
    for (auto const name : {"/Dockerfile", "/docker-compose.yml"})
        fixture.files.texts[std::string(root) + name] = "evil";
    fixture.processes.expect();
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    BOOST_TEST(
        browser.sent ==
            (Texts{"shutdownTimeout: 6000",
                   "loading: The Dockerfile of the project is not used: this server builds with its own.",
                   "loading: The docker-compose.yml of the project is not used: this server runs its own."}),
        boost::test_tools::per_element());
    BOOST_TEST(fixture.file("Dockerfile") ==
               "Dockerfile.default\nLABEL webots_cloud.server=webots-2000-1f3a9c4d\n");
    BOOST_TEST(fixture.file("docker-compose.yml") == compose_file("docker-compose-default.yml"));
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(an_operator_may_allow_the_dockerfiles_of_projects)
{
    auto setup = docker_setup();
    setup.config.project_dockerfiles = true;
    Fixture fixture(setup);
    fixture.open();
    fixture.file("Dockerfile") = "FROM ${WEBOTS_DEFAULT_IMAGE}";
    fixture.files.texts.erase("/templates/Dockerfile.default");
    fixture.processes.expect()
        .prints("manifest for cyberbotics/webots.cloud:R2025a-ubuntu22.04 not found\n")
        .exits(1);
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    BOOST_TEST(fixture.file("Dockerfile") ==
               "FROM cyberbotics/webots.cloud:R2025a-ubuntu22.04\n"
               "LABEL webots_cloud.server=webots-2000-1f3a9c4d com.docker.compose.project=\"\" "
               "com.docker.compose.service=\"\"\n\nLABEL webots_cloud.server=webots-2000-1f3a9c4d\n");
    BOOST_TEST(errors_told(browser) == 1);
    BOOST_TEST(browser.sent.back() ==
               error_line(core::Refused::ended_early_saying,
                          {{"how", "it exited with status 1"},
                           {"words", "manifest for cyberbotics/webots.cloud:R2025a-ubuntu22.04 not found"}}));
}

// Private networks and the metadata service of a cloud are no business of a Dockerfile's.
BOOST_AUTO_TEST_CASE(dockerfiles_of_projects_are_built_without_a_network_unless_the_operator_allows_it)
{
    for (bool const competes : {true, false})
        for (bool const allowed : {true, false}) {
            auto setup = docker_setup();
            setup.facts.network.reach = ProcessNetwork::Reach::internet;
            setup.config.project_dockerfiles = !competes;
            setup.config.build_network = allowed;
            Fixture fixture(setup);
            fixture.open();
            std::string const file = competes ? "controllers/Dockerfile" : "Dockerfile";
            if (competes)
                fixture.file("webots.yml") = competition;
            fixture.file("worlds/a.wbt") = "";
            fixture.file(file) = "FROM scratch\n";
            fixture.files.texts["/templates/docker-compose-competition.yml"] =
                "services:\n  webots:\n    build: .\n  controller:\n    build:\n      context: controllers\n";
            fixture.files.texts["/templates/docker-compose-default.yml"] =
                "services:\n  webots:\n    build:\n      context: .\n";
            fixture.processes.expect().prints("no\n").exits(1);
            fixture.expect_commands(looks);
            auto& browser = fixture.start();
            auto const walls = fixture.file("docker-compose.walls.yml");
            std::string const service = competes ? "  controller:\n" : "  webots:\n";
            auto const of_service = walls.substr(walls.find(service));
            BOOST_TEST((of_service.find("    build:\n      network: none\n") == std::string::npos) ==
                       allowed);
            BOOST_TEST(browser.was_told(
                           "loading: The Dockerfile of the project is built without a network") == !allowed);
        }
}

// Competitions build the project's Dockerfile whoever may use projects' Dockerfiles otherwise.
BOOST_AUTO_TEST_CASE(a_dockerfile_that_starts_from_another_simulation_is_not_built)
{
    for (bool const competes : {true, false}) {
        auto setup = docker_setup();
        setup.config.project_dockerfiles = !competes;
        Fixture fixture(setup);
        fixture.open();
        std::string const file = competes ? "controllers/Dockerfile" : "Dockerfile";
        if (competes)
            fixture.file("webots.yml") = competition;
        fixture.file("worlds/a.wbt") = "";
        fixture.file(file) = "FROM scratch\nCOPY --from=webots-2000-x_webots / /";
        auto& browser = fixture.start();
        BOOST_TEST(
            browser.sent.back() ==
            "loading: Error: Line 2 of " + file +
                " can't be used on this server: it names the image \"webots-2000-x_webots\" without its "
                "registry. Write docker.io/library/webots-2000-x_webots, or start from an image of "
                "cyberbotics/webots.cloud.");
        BOOST_TEST(fixture.run().empty());
    }
}

BOOST_AUTO_TEST_CASE(an_image_of_a_registry_is_fetched_and_not_used_where_it_adds_to_builds)
{
    struct Case
    {
        std::string answer;
        std::string told;
    };
    for (auto const& [answer, told] :
         {Case{"null\n", "shutdownTimeout: 6000"},
          Case{"[\"COPY --from=0a / /\"]\n", "loading: Error: The image docker.io/a can't be used on this "
                                             "server: it adds instructions to builds "
                                             "that start from it (ONBUILD). Start from another one."}}) {
        Fixture fixture;
        fixture.open();
        fixture.has_competition("FROM docker.io/a");
        fixture.processes.expect().prints("No such image: docker.io/a\n").exits(1);
        fixture.expect_commands(1);
        fixture.expect_commands(1, answer);
        bool const starts = answer == "null\n";
        if (starts) {
            fixture.processes.expect();
            fixture.expect_commands(looks);
        }
        auto& browser = fixture.start();
        BOOST_TEST(browser.sent.back() == told);
        BOOST_TEST(
            fixture.has_run("/bin/docker image inspect --format {{json .Config.OnBuild}} docker.io/a"));
        BOOST_TEST(fixture.has_run("/bin/docker pull --quiet docker.io/a"));
        if (starts)
            fixture.leave(browser);
    }
    Fixture fixture;
    fixture.open();
    fixture.has_competition("FROM docker.io/a");
    for (int i = 0; i < 2; ++i)
        fixture.processes.expect().prints("manifest for docker.io/a not found\n").exits(1);
    BOOST_TEST(fixture.start().sent.back() ==
               "loading: Error: The image docker.io/a can't be fetched: manifest for docker.io/a not found");
}

BOOST_AUTO_TEST_CASE(a_reset_in_a_competition_restarts_the_controller)
{
    Fixture fixture;
    fixture.open();
    fixture.file("webots.yml") = competition;
    fixture.file("worlds/a.wbt") = "Robot { controller \"participant\" }";
    fixture.file("controllers/Dockerfile") = "FROM scratch";
    fixture.files.texts["/templates/remote_controller_launcher.py"] = "launch";
    fixture.processes.expect()
        .prints("webots-1  | .\n")
        .after(5s)
        .prints("webots-1  | reset\nwebots-1  | .\n");
    fixture.processes.expect().prints("No such service\n").exits(1);
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.world.advance(5s);
    BOOST_TEST(fixture.file("worlds/a.wbt") == "Robot { controller \"<extern>\" }");
    BOOST_TEST(fixture.file("remote_controller_launcher.py") == "launch");
    BOOST_TEST(fixture.file("docker-compose.yml") == compose_file("docker-compose-competition.yml"));
    BOOST_TEST(
        fixture.has_run("/bin/docker compose -f /instances/1/project/docker-compose.yml -f "
                        "/instances/1/project/docker-compose.walls.yml restart --timeout 0 controller"));
    BOOST_TEST(fixture.log.contains("[1] The controller can't be restarted: No such service"));
    BOOST_TEST(browser.sent.back() == ".");
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_file_that_is_put_back_is_put_into_the_containers_as_well)
{
    Fixture fixture;
    fixture.open();
    fixture.source.files = {"controllers/walk/walk.py"};
    fixture.processes.expect().prints("webots-1  | .\n");
    auto& browser = fixture.start();
    fixture.processes.expect().prints("a1\twebots\nb2\ttheia\nc3\tcontroller\n").exits(0);
    fixture.processes.expect().exits(0);
    fixture.processes.expect().prints("Error: No such container:path: c3:/usr\n").exits(1);
    browser.browser_says(R"({"reset controller":"walk/walk.py"})");
    fixture.world.settle();
    BOOST_TEST(fixture.has_run("/bin/docker cp /instances/1/project/controllers/walk/walk.py "
                               "a1:/usr/local/webots-project/controllers/walk/walk.py"));
    BOOST_TEST(browser.sent.back() ==
               "loading: Error: The file can't be brought to where the simulation runs: "
               "Error: No such container:path: c3:/usr.");
    BOOST_TEST(!browser.close_code.has_value());
    fixture.expect_commands(looks);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(a_reset_elsewhere_restarts_nothing)
{
    Fixture fixture;
    fixture.open();
    fixture.processes.expect().prints("webots-1  | .\nwebots-1  | reset\n");
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.leave(browser);
    BOOST_TEST(fixture.run().size() == 1u + looks);
}

BOOST_AUTO_TEST_CASE(a_competition_without_a_container_for_the_participant_is_refused_in_words)
{
    Fixture fixture;
    fixture.open();
    fixture.file("webots.yml") = competition;
    fixture.file("worlds/a.wbt") = "";
    auto& browser = fixture.start();
    BOOST_TEST(
        browser.sent ==
            (Texts{"loading: Error: A competition needs a Dockerfile in its folder controllers, and the "
                   "project has none."}),
        boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(the_time_to_get_ready_counts_from_the_last_word_of_compose)
{
    Fixture fixture;
    fixture.open();
    fixture.processes.expect()
        .after(299s)
        .prints("Step 1/9\n")
        .after(299s)
        .prints("Step 2/9\n")
        .after(299s)
        .prints("webots-1 | noise\n");
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.world.advance(598s + 299s);
    BOOST_TEST(errors_told(browser) == 0);
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() == error_line(core::Refused::not_loaded, {{"seconds", "300"}}));
}

BOOST_AUTO_TEST_CASE(the_end_of_the_simulator_ends_the_simulation_while_an_editor_runs)
{
    Fixture fixture;
    fixture.open();
    fixture.processes.expect().prints("webots-1  | .\n").after(1s).prints("webots-1 exited with code 139\n");
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.world.advance(1s);
    BOOST_TEST(browser.sent.back() ==
               error_line(core::Refused::crashed, {{"how", "it exited with code 139"}}));
    BOOST_TEST(browser.close_code.has_value());
}

BOOST_AUTO_TEST_CASE(a_flood_of_words_is_shown_in_part)
{
    Fixture fixture;
    fixture.open();
    std::string flood;
    for (int i = 0; i < 2000; ++i)
        flood += "building\n";
    fixture.processes.expect().prints(flood).after(1s).prints("Step 2/9\nwebots-1 | .\n");
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    BOOST_TEST(browser.sent.size() == 201u);
    fixture.world.advance(1s);
    BOOST_TEST(browser.was_told("loading: Step 2/9"));
    BOOST_TEST(browser.was_told("webots:"));
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(what_compose_left_is_removed_when_the_simulation_ends)
{
    Fixture fixture;
    fixture.open();
    fixture.processes.expect();
    fixture.expect_commands(
        1, concat("c1\t\"", project, "\"\t\"\"\tCreated\nc2\t\"webots-2000-1f3a9c4d-2-0\"\t\"\"\tUp\n"));
    fixture.expect_commands(1);
    fixture.expect_commands(2);
    fixture.expect_commands(
        1, concat(project, "_webots:latest\tnow\nwebots-2000-1f3a9c4d-2-0_webots:latest\tnow\n"));
    fixture.expect_commands(1);
    fixture.expect_commands(looks);
    auto& browser = fixture.start();
    fixture.leave(browser);
    fixture.world.advance(1s);
    BOOST_TEST(fixture.has_run("/bin/docker rm --force --volumes c1"));
    BOOST_TEST(fixture.has_run(concat("/bin/docker rmi --force --no-prune ", project, "_webots:latest")));
    BOOST_TEST(fixture.run().size() == 1u + looks + 2u + looks);
}

BOOST_AUTO_TEST_CASE(old_images_go_only_where_the_operator_has_named_those_that_stay)
{
    auto setup = docker_setup();
    setup.config.persistent_images = Texts{"cyberbotics/webots.cloud:R2025a-ubuntu22.04"};
    Fixture fixture(setup);
    fixture.open();
    fixture.processes.expect();
    fixture.expect_commands(looks);
    fixture.expect_commands(1, "cyberbotics/webots.cloud:R2025a-ubuntu22.04\t1970-01-01 00:00:00 +0000 UTC\n"
                               "cyberbotics/webots.cloud:R2023b-ubuntu22.04\t1970-01-01 00:00:00 +0000 UTC\n"
                               "debian:12\t1970-01-01 00:00:00 +0000 UTC\n");
    fixture.expect_commands(1, "0a1b2c3d4e5f\t1970-01-01 00:00:00 +0000 UTC\n");
    fixture.expect_commands(1, "a container\n");
    fixture.expect_commands(2);
    auto& browser = fixture.start();
    fixture.leave(browser);
    BOOST_TEST(fixture.run().size() == 1u + looks + 5u);
    BOOST_TEST(fixture.has_run("/bin/docker images --filter dangling=true --filter "
                               "label=webots_cloud.server=webots-2000-1f3a9c4d --format "
                               "{{.ID}}\t{{.CreatedAt}}"));
    BOOST_TEST(fixture.has_run(
        "/bin/docker ps --quiet --filter ancestor=cyberbotics/webots.cloud:R2023b-ubuntu22.04"));
    BOOST_TEST(fixture.has_run("/bin/docker ps --quiet --filter ancestor=0a1b2c3d4e5f"));
    BOOST_TEST(fixture.has_run("/bin/docker rmi 0a1b2c3d4e5f"));
}

/// A competition, a reset and an end: in the n-th run the n-th call of one seam fails.
int run_until_nothing_blows(testing::Fuse& (*fuse_of)(Fixture&))
{
    for (int call = 1;; ++call) {
        Fixture fixture;
        fixture.open();
        fixture.has_competition("FROM scratch");
        fixture.processes.expect().prints("webots-1  | .\nwebots-1 | reset\n");
        fixture.expect_commands(1 + looks);
        fuse_of(fixture) = testing::Fuse(call);
        auto& browser = fixture.start();
        bool const blown = fuse_of(fixture).blown();
        bool const harmless = fixture.log.contains("Port 2001 is already in use.") ||
                              fixture.log.contains("The controller can't be restarted");
        BOOST_TEST(errors_told(browser) == (blown && !harmless ? 1 : 0), "call " << call);
        if (!browser.close_code)
            fixture.leave(browser);
        if (!fuse_of(fixture).blown())
            return call - 1;
    }
}

BOOST_AUTO_TEST_CASE(whatever_fails_exactly_one_error_is_told_and_nothing_is_left)
{
    auto const files = [](Fixture& fixture) -> testing::Fuse& { return fixture.files.fuse; };
    auto const processes = [](Fixture& fixture) -> testing::Fuse& { return fixture.processes.fuse; };
    BOOST_TEST(run_until_nothing_blows(files) ==
               7); // project, compose file, competition, launcher, system calls, Dockerfile; all written
    BOOST_TEST(run_until_nothing_blows(processes) == 7); // a port, compose, a restart, four listings
}

BOOST_AUTO_TEST_SUITE_END()
