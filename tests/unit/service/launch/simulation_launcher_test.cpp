#include "refusal_sentences.hpp"
#include "service/setups.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/sandbox/simulation_user.hpp"

#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/testing/memory_text_files.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_processes.hpp>
#include <webots_cloud/testing/world.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>
#include <csignal>
#include <optional>
#include <set>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(simulation_launcher)

namespace {

using Texts = std::vector<std::string>;

LauncherSetup launcher_setup()
{
    LauncherSetup setup;
    setup.facts.webots = "/opt/webots/webots";
    setup.config.max_simulations = 2;
    setup.config.timeout = 600s;
    setup.config.start_timeout = 300s;
    setup.facts.environment = {{"PATH", "/bin"}, {"SECRET", "x"}, {"LAB_HOST", "h"}, {"DISPLAY", ":9"}};
    setup.config.simulator_environment = {"LAB_*", "ROS_DOMAIN_ID=7"};
    return setup;
}

LaunchSpec launch_spec(std::string mode = "x3d")
{
    LaunchSpec spec;
    spec.instance = "/instances/1";
    spec.root = "/instances/1/project";
    spec.world = "/instances/1/project/worlds/a.wbt";
    spec.mode = std::move(mode);
    spec.world_header = "#VRML_SIM R2025a utf8";
    spec.label = "1";
    return spec;
}

/// Records which ports were held when a program was started; starting one takes time.
class SlowHost final : public ProcessHost
{
public:
    explicit SlowHost(testing::World& world) : clock_(world.clock), processes(world.clock) {}

    asio::awaitable<result<std::unique_ptr<Process>>> start(ProcessSpec spec) override
    {
        held_at_start = processes.held();
        auto const waited = co_await clock_.wait_until(clock_.now() + delay);
        if (!waited)
            co_return waited.error();
        co_return co_await processes.start(std::move(spec));
    }

    result<std::unique_ptr<PortHold>> hold_port(std::uint16_t port) override
    {
        asked_for.push_back(port);
        return processes.hold_port(port);
    }

private:
    Clock& clock_;

public:
    testing::ScriptedProcesses processes;
    Duration delay{};
    std::size_t held_at_start = 0;
    std::vector<std::uint16_t> asked_for;
};

/// A launcher on fakes. At its end nothing may be left: no process, port or timer.
struct Fixture
{
    explicit Fixture(LauncherSetup const& setup = launcher_setup())
        : launcher(setup.config, setup.facts, host, world.clock, log.logger())
    {}

    ~Fixture()
    {
        BOOST_TEST(tasks.size() == 0u);
        BOOST_TEST(processes.alive() == 0);
        BOOST_TEST(processes.held() == 0u);
        BOOST_TEST(launcher.running() == 0u);
        BOOST_TEST(world.clock.pending() == 0u);
    }

    result<std::unique_ptr<Simulation>> launch(LaunchSpec spec = launch_spec())
    {
        return world.run(launcher.launch(std::move(spec)));
    }

    std::unique_ptr<Simulation> launched()
    {
        auto simulation = launch();
        BOOST_TEST_REQUIRE(simulation.has_value());
        return std::move(*simulation);
    }

    /// The next event, which must be one of this type.
    template<class Event>
    Event next(Simulation& simulation)
    {
        auto const event = world.run(simulation.next_event());
        BOOST_TEST_REQUIRE(event.has_value());
        BOOST_TEST_REQUIRE(std::holds_alternative<Event>(*event), "event " << event->index());
        return std::get<Event>(*event);
    }

    /// Since the test began.
    Duration elapsed() const { return world.clock.now() - began; }

    testing::World world;
    TimePoint began = world.clock.now();
    testing::RecordingLog log;
    SlowHost host{world};
    testing::ScriptedProcesses& processes = host.processes;
    SimulationLauncher launcher;
    async::TaskGroup tasks{world.executor()};
};

using Taken = std::optional<result<SimulationEvent>>;

asio::awaitable<void> take_event(Simulation& simulation, Taken& taken)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto event = co_await simulation.next_event();
    taken.emplace(std::move(event));
}

using Launched = std::optional<result<std::unique_ptr<Simulation>>>;

asio::awaitable<void> launch_into(SimulationLauncher& launcher, LaunchSpec spec, Launched& launched)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto simulation = co_await launcher.launch(std::move(spec));
    launched.emplace(std::move(simulation));
}

std::string variable(ProcessSpec const& process, std::string const& name)
{
    auto const& all = process.environment;
    auto const found =
        std::find_if(all.begin(), all.end(), [&](auto const& entry) { return entry.first == name; });
    return found == all.end() ? "(unset)" : found->second;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_simulation_is_ready_then_tells_what_it_was_before_then_lives_and_ends_last)
{
    Fixture fixture;
    fixture.processes.expect()
        .prints("real-time\n")
        .after(2s)
        .prints(".\n")
        .after(5s)
        .prints(".\n")
        .after(1s)
        .prints("pause\n")
        .after(1s)
        .exits(0);
    auto const simulation = fixture.launched();
    BOOST_TEST(fixture.next<SimulationReady>(*simulation).port == 2001);
    BOOST_TEST((fixture.elapsed() == 2s));
    BOOST_TEST(fixture.next<SimulationActivity>(*simulation).running);
    fixture.next<SimulationHeartbeat>(*simulation);
    BOOST_TEST((fixture.elapsed() == 7s));
    BOOST_TEST(!fixture.next<SimulationActivity>(*simulation).running);
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST((fixture.elapsed() == 9s));
    BOOST_TEST(ended.reason.message() == sentence(core::Refused::quit));
    BOOST_TEST((ended.status == ExitStatus(0, false)));
    BOOST_TEST(ended.was_ready);
}

BOOST_AUTO_TEST_CASE(each_way_to_end_has_its_reason_its_status_and_whether_it_was_ready)
{
    struct Row
    {
        char const* output;
        ExitStatus status;
        std::string reason;
        bool was_ready;
    };
    std::vector<Row> const rows{
        {"", ExitStatus(0, false), sentence(core::Refused::ended_early, {{"how", "it exited with status 0"}}),
         false},
        {"Error: no screen\nTry --help\n", ExitStatus(7, false),
         sentence(core::Refused::ended_early_saying,
                  {{"how", "it exited with status 7"}, {"words", "Error: no screen"}}),
         false},
        {"", ExitStatus(SIGSEGV, true),
         sentence(core::Refused::ended_early, {{"how", "it was ended by signal 11"}}), false},
        {".\n", ExitStatus(0, false), sentence(core::Refused::quit), true},
        {".\nError: late\n", ExitStatus(7, false),
         sentence(core::Refused::crashed, {{"how", "it exited with status 7"}}), true},
        {".\n", ExitStatus(SIGSEGV, true),
         sentence(core::Refused::crashed, {{"how", "it was ended by signal 11"}}), true}};
    for (auto const& row : rows) {
        Fixture fixture;
        auto& script = fixture.processes.expect().prints(row.output).after(1s);
        if (row.status.signalled)
            script.crashes(row.status.code);
        else
            script.exits(row.status.code);
        auto const simulation = fixture.launched();
        if (row.was_ready)
            fixture.next<SimulationReady>(*simulation);
        auto const ended = fixture.next<SimulationEnded>(*simulation);
        BOOST_TEST(ended.reason.message() == row.reason);
        BOOST_TEST((ended.status == row.status), row.reason);
        BOOST_TEST(ended.was_ready == row.was_ready, row.reason);
    }
}

BOOST_AUTO_TEST_CASE(what_a_program_gets_is_its_folder_its_grace_and_what_it_needs_of_our_environment)
{
    auto setup = launcher_setup();
    setup.config.grace = 7s;
    Fixture fixture(setup);
    fixture.processes.expect();
    auto const simulation = fixture.launched();
    auto const& process = fixture.processes.started().front();
    BOOST_TEST(process.directory == "/instances/1/project/worlds");
    BOOST_TEST((process.grace == 7s));
    BOOST_TEST(!process.set_user_id);
    BOOST_TEST(process.cleanup_command.empty());
    BOOST_TEST(variable(process, "PATH") == "/bin");
    BOOST_TEST(variable(process, "DISPLAY") == ":0");
    BOOST_TEST(variable(process, "LAB_HOST") == "h");
    BOOST_TEST(variable(process, "ROS_DOMAIN_ID") == "7");
    BOOST_TEST(variable(process, "SECRET") == "(unset)");
    BOOST_TEST(simulation->process_id() == 1001);
    BOOST_TEST(simulation->announcements().empty());
}

BOOST_AUTO_TEST_CASE(another_user_gets_the_instance_and_nothing_that_is_the_servers_users)
{
    auto setup = launcher_setup();
    setup.facts.environment.emplace_back("XDG_RUNTIME_DIR", "/run/user/0");
    setup.facts.environment.emplace_back("XAUTHORITY", "/home/teacher/.Xauthority");
    setup.facts.sandbox.user.kind = SimulationUser::Kind::of_its_own;
    setup.facts.sandbox.user.groups = {44};
    setup.facts.sandbox.user.name = "simulation";
    setup.facts.sandbox.user.visible = {"/home/teacher/webots"};
    Fixture fixture(setup);
    fixture.processes.expect();
    fixture.processes.expect();
    auto const simulation = fixture.launched();
    auto const& process = fixture.processes.started().front();
    BOOST_TEST_REQUIRE(process.user.has_value());
    BOOST_TEST(process.user->user == core::own_user_number(0, 2001));
    BOOST_TEST(process.user->group == process.user->user);
    BOOST_TEST(process.user->groups == std::vector<std::uint32_t>{44});
    BOOST_TEST(process.user->folder == "/instances/1");
    BOOST_TEST(process.user->x_authority == "/home/teacher/.Xauthority");
    BOOST_TEST((process.user->visible == std::vector<std::filesystem::path>{"/home/teacher/webots"}));
    BOOST_TEST(variable(process, "HOME") == "/instances/1/.webots_cloud-home");
    BOOST_TEST(variable(process, "XAUTHORITY") == "/instances/1/.webots_cloud-home/Xauthority");
    BOOST_TEST(variable(process, "TMPDIR") == "/tmp");
    BOOST_TEST(variable(process, "XDG_RUNTIME_DIR") == "(unset)");
    BOOST_TEST(variable(process, "USER") == "simulation");
    auto const next = fixture.launched();
    BOOST_TEST(fixture.processes.started().back().user->user == core::own_user_number(1, 2002));
}

BOOST_AUTO_TEST_CASE(a_program_with_a_display_of_its_own_gets_no_other)
{
    auto setup = launcher_setup();
    setup.facts.display.clear();
    setup.facts.private_display.server = "/usr/bin/Xvfb";
    setup.facts.private_display.guard = "/opt/guard";
    Fixture fixture(setup);
    fixture.processes.expect();
    auto const simulation = fixture.launched();
    auto const& process = fixture.processes.started().front();
    Texts const begin(process.argv.begin(), process.argv.begin() + 5);
    BOOST_TEST(begin == (Texts{"/opt/guard", "--display", "/usr/bin/Xvfb", "30000", "/opt/webots/webots"}),
               boost::test_tools::per_element());
    BOOST_TEST(process.own_displays);
    BOOST_TEST(variable(process, "DISPLAY") == "(unset)");
    BOOST_TEST(!fixture.log.contains("--display")); // operators know the command line of Webots
}

BOOST_AUTO_TEST_CASE(in_a_sandbox_a_display_of_its_own_is_started_inside)
{
    auto setup = launcher_setup();
    setup.facts.private_display.server = "/usr/bin/Xvfb";
    setup.facts.private_display.guard = "/opt/guard";
    setup.facts.sandbox.bubblewrap = "/usr/bin/bwrap";
    setup.facts.sandbox.copied = {"/etc/hosts"};
    Fixture fixture(setup);
    fixture.processes.expect();
    auto const simulation = fixture.launched();
    auto const& process = fixture.processes.started().front();
    BOOST_TEST(process.argv.front() == "/usr/bin/bwrap");
    auto const has = [&](Texts const& words) {
        return std::search(process.argv.begin(), process.argv.end(), words.begin(), words.end()) !=
               process.argv.end();
    };
    BOOST_TEST(has({"--", "/opt/guard", "--display", "/usr/bin/Xvfb"}));
    BOOST_TEST(has({"--ro-bind-try", "/opt/guard", "/opt/guard"}));
    BOOST_TEST(has({"--tmpfs", "/tmp/.X11-unix"}));
    BOOST_TEST(has({"--file", std::to_string(ProcessSpec::first_opened), "/etc/hosts"}));
    BOOST_TEST((process.opened == std::vector<std::filesystem::path>{"/etc/hosts"}));
    BOOST_TEST(!process.own_displays); // there are no others in there
}

BOOST_AUTO_TEST_CASE(a_compiler_runs_within_the_walls_of_the_simulation_and_beside_it)
{
    auto setup = launcher_setup();
    setup.facts.sandbox.bubblewrap = "/usr/bin/bwrap";
    setup.facts.sandbox.network.reach = ProcessNetwork::Reach::internet;
    setup.facts.sandbox.user.kind = SimulationUser::Kind::of_its_own;
    setup.facts.compiler.make = "/usr/bin/make";
    setup.facts.compiler.home = "/opt/webots";
    Fixture fixture(setup);
    fixture.processes.expect();
    fixture.processes.expect().exits(0);
    auto const simulation = fixture.launched();
    ControllerSources sources("drive", "/instances/1/project/controllers/drive", false);
    auto const compiled = fixture.world.run(simulation->compile(std::move(sources)));
    BOOST_TEST(compiled.outcome.has_value());
    auto const& process = fixture.processes.started().back();
    BOOST_TEST(process.argv.front() == "/usr/bin/bwrap");
    BOOST_TEST(process.argv.back() == "/opt/webots/resources/Makefile.include");
    BOOST_TEST(variable(process, "WEBOTS_HOME") == "/opt/webots");
    BOOST_TEST(variable(process, "SECRET") == "(unset)");
    BOOST_TEST((process.network.reach == ProcessNetwork::Reach::none));
    BOOST_TEST(process.network.port == 0);
    BOOST_TEST_REQUIRE(process.user.has_value());
    BOOST_TEST(process.user->user == core::own_user_number(0, 2001));
    BOOST_TEST(process.user->folder.empty()); // it is that user's already
    BOOST_TEST((process.user->visible.back() == "/instances/1"));
    BOOST_TEST(process.directory.empty());
}

BOOST_AUTO_TEST_CASE(a_simulation_that_loses_its_display_ends_with_a_sentence_about_that)
{
    for (bool const is_ready : {false, true}) {
        Fixture fixture;
        auto& script = fixture.processes.expect();
        if (is_ready)
            script.prints(".\n");
        script.after(1s).prints("display has ended: (EE) no memory left\n").crashes(SIGKILL);
        auto simulation = fixture.launched();
        if (is_ready)
            fixture.next<SimulationReady>(*simulation);
        auto const ended = fixture.next<SimulationEnded>(*simulation);
        BOOST_TEST(ended.reason.message() == sentence(core::Refused::display_ended));
        BOOST_TEST(fixture.log.contains("display has ended: (EE) no memory left"));
    }
}

BOOST_AUTO_TEST_CASE(an_unknown_mode_is_refused_before_a_port_is_asked_for)
{
    Fixture fixture;
    auto const refused = fixture.launch(launch_spec("holo\ngram"));
    BOOST_TEST_REQUIRE(!refused.has_value());
    BOOST_TEST(refused.error() == errc::invalid_argument);
    BOOST_TEST(refused.error().detail().find("Expected w3d, x3d or mjpeg.") != std::string::npos);
    BOOST_TEST(refused.error().detail().find('\n') == std::string::npos);
    BOOST_TEST(fixture.host.asked_for.empty());
    BOOST_TEST(fixture.processes.started().empty());
}

BOOST_AUTO_TEST_CASE(a_port_is_lent_until_its_simulation_is_destroyed_not_only_until_that_has_ended)
{
    Fixture fixture;
    fixture.processes.expect().exits(0);
    auto first = fixture.launched();
    fixture.next<SimulationEnded>(*first);
    BOOST_TEST(fixture.launcher.running() == 1u);
    fixture.processes.expect().prints(".\n");
    auto const second = fixture.launched();
    BOOST_TEST(fixture.next<SimulationReady>(*second).port == 2002);
    auto const none = fixture.launch();
    BOOST_TEST_REQUIRE(!none.has_value());
    BOOST_TEST(none.error() == errc::unavailable);
    BOOST_TEST(none.error().detail() ==
               "Too many open connections (>2): this simulation server is full. Please try again later.");
    first.reset();
    BOOST_TEST(fixture.launcher.running() == 1u);
    fixture.processes.expect().prints(".\n");
    auto const third = fixture.launched();
    BOOST_TEST(fixture.next<SimulationReady>(*third).port == 2001);
}

BOOST_AUTO_TEST_CASE(a_port_that_somebody_else_has_is_skipped_said_and_not_lent)
{
    Fixture fixture;
    fixture.processes.taken = {2001};
    fixture.processes.expect().prints(".\n");
    auto simulation = fixture.launched();
    BOOST_TEST(fixture.next<SimulationReady>(*simulation).port == 2002);
    BOOST_TEST(fixture.log.contains("Port 2001 is already in use."));
    BOOST_TEST(fixture.launcher.running() == 1u);
    simulation.reset();
    fixture.processes.taken = {2001, 2002};
    auto const none = fixture.launch();
    BOOST_TEST((none.error() == errc::unavailable));
    BOOST_TEST(fixture.launcher.running() == 0u);
}

// Otherwise another program could bind the port in between, and browsers would connect to it.
BOOST_AUTO_TEST_CASE(a_port_is_ours_until_the_program_starts_and_free_for_it_then)
{
    Fixture fixture;
    fixture.host.held_at_start = 99;
    fixture.processes.expect();
    auto const simulation = fixture.launched();
    BOOST_TEST(fixture.host.asked_for == std::vector<std::uint16_t>{2001}, boost::test_tools::per_element());
    BOOST_TEST(fixture.host.held_at_start == 0u);
}

BOOST_AUTO_TEST_CASE(a_program_that_does_not_start_gives_its_port_back_and_says_why)
{
    Fixture fixture; // with an empty script, starting fails
    auto const failed = fixture.launch();
    BOOST_TEST_REQUIRE(!failed.has_value());
    BOOST_TEST(failed.error() == errc::start_failed);
    BOOST_TEST(failed.error().detail() ==
               sentence(core::Refused::not_started, {{"why", "/opt/webots/webots is not in the script"}}));
    BOOST_TEST(fixture.launcher.running() == 0u);
    BOOST_TEST(!fixture.log.contains("started"));
}

BOOST_AUTO_TEST_CASE(a_host_that_has_a_sentence_of_its_own_is_heard_with_its_code)
{
    Fixture fixture;
    auto const why = core::refused(core::Refused::job_refused, {{"words", "no partition"}});
    fixture.processes.fuse = testing::Fuse(2, why); // after its port
    auto const failed = fixture.launch();
    BOOST_TEST_REQUIRE(!failed.has_value());
    BOOST_TEST(failed.error().detail() == why.detail());
    BOOST_TEST_REQUIRE(failed.error().info());
    BOOST_TEST(failed.error().info()->code == "cluster");
}

BOOST_AUTO_TEST_CASE(whatever_fails_in_a_launch_nothing_is_left_of_it)
{
    for (int calls = 1;; ++calls) {
        Fixture fixture;
        fixture.processes.fuse = testing::Fuse(calls);
        fixture.processes.expect();
        auto const simulation = fixture.launch();
        // When a port is in use, the next one is taken.
        BOOST_TEST(simulation.has_value() == (calls != 2), calls);
        BOOST_TEST(fixture.launcher.running() == (simulation ? 1u : 0u));
        if (!fixture.processes.fuse.blown())
            break;
    }
}

BOOST_AUTO_TEST_CASE(a_launch_that_is_cancelled_gives_its_port_back_and_starts_nothing)
{
    Fixture fixture;
    fixture.host.delay = 10s;
    fixture.processes.expect();
    Launched launched;
    auto const task = fixture.tasks.spawn(launch_into(fixture.launcher, launch_spec(), launched));
    fixture.world.advance(5s);
    BOOST_TEST(fixture.launcher.running() == 1u); // while it is being started
    async::TaskGroup::cancel(task);
    fixture.world.settle();
    BOOST_TEST_REQUIRE(launched.has_value());
    BOOST_TEST_REQUIRE(!launched->has_value());
    BOOST_TEST((launched->error().code() == asio::error::operation_aborted));
    BOOST_TEST(fixture.launcher.running() == 0u);
    BOOST_TEST(fixture.processes.started().empty());
}

BOOST_AUTO_TEST_CASE(a_wait_that_is_cancelled_loses_nothing_not_even_half_a_line)
{
    Fixture fixture;
    fixture.processes.expect().prints("loading\n.").after(2s).prints("\n").after(2s).prints(".\n");
    auto const simulation = fixture.launched();
    for (auto const until_the_next : {1s, 2s}) {
        Taken taken;
        auto const task = fixture.tasks.spawn(take_event(*simulation, taken));
        fixture.world.settle();
        BOOST_TEST_REQUIRE(!taken.has_value());
        async::TaskGroup::cancel(task);
        fixture.world.settle();
        BOOST_TEST_REQUIRE(taken.has_value());
        BOOST_TEST_REQUIRE(!taken->has_value());
        BOOST_TEST((taken->error().code() == asio::error::operation_aborted));
        fixture.world.advance(until_the_next);
    }
    BOOST_TEST(fixture.next<SimulationReady>(*simulation).port == 2001);
    fixture.next<SimulationHeartbeat>(*simulation);
    simulation->terminate();
    fixture.next<SimulationEnded>(*simulation);
}

BOOST_AUTO_TEST_CASE(a_simulation_that_is_destroyed_is_killed_and_its_port_is_free)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").stubborn();
    auto simulation = fixture.launched();
    fixture.next<SimulationReady>(*simulation);
    simulation.reset();
    BOOST_TEST(fixture.processes.alive() == 0);
    BOOST_TEST(fixture.launcher.running() == 0u);
}

BOOST_AUTO_TEST_CASE(to_ask_for_the_end_again_changes_neither_the_moment_nor_the_reason)
{
    auto setup = launcher_setup();
    setup.config.grace = 7s;
    Fixture fixture(setup);
    fixture.processes.expect().prints(".\n").stubborn();
    auto const simulation = fixture.launched();
    fixture.next<SimulationReady>(*simulation);
    simulation->terminate();
    fixture.world.advance(5s);
    simulation->terminate();
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST((fixture.elapsed() == 7s));
    BOOST_TEST((ended.status == ExitStatus(SIGKILL, true)));
    BOOST_TEST(ended.reason.detail() == ""); // whoever ended it knows the reason
    BOOST_TEST(ended.was_ready);
    simulation->terminate(); // harmless once the process is gone
}

BOOST_AUTO_TEST_CASE(who_asks_for_the_end_of_one_that_is_being_ended_hides_no_reason)
{
    auto setup = launcher_setup();
    setup.config.grace = 7s;
    Fixture fixture(setup);
    fixture.processes.expect().prints("loading\n").stubborn();
    auto const simulation = fixture.launched();
    Taken taken;
    fixture.tasks.spawn(take_event(*simulation, taken));
    fixture.world.advance(302s); // two seconds into the grace
    BOOST_TEST_REQUIRE(!taken.has_value());
    simulation->terminate();
    fixture.world.advance(5s);
    BOOST_TEST_REQUIRE(taken.has_value());
    BOOST_TEST_REQUIRE(taken->has_value());
    BOOST_TEST(std::get<SimulationEnded>(**taken).reason.message() ==
               sentence(core::Refused::not_loaded, {{"seconds", "300"}}));
}

BOOST_AUTO_TEST_CASE(a_start_that_takes_too_long_is_ended_to_the_second_and_what_was_missing_is_said)
{
    struct Row
    {
        char const* output;
        std::vector<std::uint16_t> listens;
        std::string reason;
    };
    std::vector<Row> const rows{
        {"loading\n", {2001}, sentence(core::Refused::not_loaded, {{"seconds", "300"}})},
        {".\n", {}, sentence(core::Refused::no_port, {{"seconds", "300"}})},
        {".\n", {2012}, sentence(core::Refused::no_port, {{"seconds", "300"}})}};
    for (auto const& row : rows) {
        Fixture fixture;
        fixture.processes.expect().prints(row.output).listens(row.listens);
        auto const simulation = fixture.launched();
        auto const ended = fixture.next<SimulationEnded>(*simulation);
        BOOST_TEST(ended.reason.message() == row.reason);
        BOOST_TEST(!ended.was_ready);
        BOOST_TEST((fixture.elapsed() == 300s), row.reason);
    }
}

// The guard is the one who knows: between its word and ours no time may pass.
BOOST_AUTO_TEST_CASE(a_simulator_whose_guard_says_that_it_listens_is_ready_at_once_and_nobody_looks)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(3ms).is_reached().after(1s).prints(".\n").exits(0);
    auto const simulation = fixture.launched();
    BOOST_TEST(fixture.next<SimulationReady>(*simulation).port == 2001);
    BOOST_TEST((fixture.elapsed() == 3ms));
    fixture.next<SimulationHeartbeat>(*simulation);
    BOOST_TEST(fixture.next<SimulationEnded>(*simulation).was_ready);
    BOOST_TEST(fixture.processes.looks().empty());
}

BOOST_AUTO_TEST_CASE(a_simulator_that_listens_before_its_world_is_loaded_is_ready_when_that_is)
{
    Fixture fixture;
    fixture.processes.expect().is_reached().after(5s).prints("loading\n.\n");
    auto const simulation = fixture.launched();
    fixture.next<SimulationReady>(*simulation);
    BOOST_TEST((fixture.elapsed() == 5s));
    BOOST_TEST(fixture.processes.looks().empty());
    simulation->terminate();
    fixture.next<SimulationEnded>(*simulation);
}

BOOST_AUTO_TEST_CASE(a_guard_that_never_says_so_ends_the_start_at_its_limit)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").is_never_reached();
    auto const simulation = fixture.launched();
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST(ended.reason.message() == sentence(core::Refused::no_port, {{"seconds", "300"}}));
    BOOST_TEST((fixture.elapsed() == 300s));
    BOOST_TEST(fixture.processes.looks().empty());
}

// The time limit counts from the start, whether or not anybody has asked for events.
BOOST_AUTO_TEST_CASE(a_simulation_that_nobody_has_asked_about_is_ended_at_its_limit_when_somebody_does)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(5s).prints(".\n");
    auto const simulation = fixture.launched();
    fixture.world.advance(700s);
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST(ended.reason.message() == sentence(core::Refused::time_limit, {{"seconds", "600"}}));
    BOOST_TEST((fixture.elapsed() == 700s));
    BOOST_TEST(!ended.was_ready);
}

BOOST_AUTO_TEST_CASE(a_life_that_is_shorter_than_a_start_ends_the_start)
{
    auto setup = launcher_setup();
    setup.config.timeout = 10s;
    Fixture fixture(setup);
    fixture.processes.expect().prints("loading\n");
    auto const simulation = fixture.launched();
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST(ended.reason.message() == sentence(core::Refused::time_limit, {{"seconds", "10"}}));
    BOOST_TEST((fixture.elapsed() == 10s));
}

BOOST_AUTO_TEST_CASE(of_a_mode_that_changes_again_and_again_only_the_last_is_told)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(1s).prints("pause\nreal-time\npause\nfast\n");
    auto const simulation = fixture.launched();
    fixture.next<SimulationReady>(*simulation);
    BOOST_TEST(fixture.next<SimulationActivity>(*simulation).running);
    simulation->terminate();
    fixture.next<SimulationEnded>(*simulation);
}

BOOST_AUTO_TEST_CASE(who_wants_the_output_gets_every_line_but_heartbeats_and_the_last_without_its_end)
{
    Fixture fixture;
    Texts lines;
    auto spec = launch_spec();
    spec.output = [&lines](std::string_view line) { lines.emplace_back(line); };
    fixture.processes.expect().prints("one\r\n.\ntw").after(1s).prints("o\n.\n\npause\nlast").exits(0);
    auto const simulation = fixture.launch(std::move(spec));
    BOOST_TEST_REQUIRE(simulation.has_value());
    fixture.next<SimulationReady>(**simulation);
    fixture.next<SimulationHeartbeat>(**simulation);
    fixture.next<SimulationActivity>(**simulation);
    fixture.next<SimulationEnded>(**simulation);
    BOOST_TEST(lines == (Texts{"one", "two", "", "pause", "last"}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(what_a_simulation_has_consumed_is_known_until_it_has_ended)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").consumes(50, 12'300'000);
    auto const simulation = fixture.launched();
    fixture.next<SimulationReady>(*simulation);
    fixture.world.advance(10s);
    auto const usage = fixture.world.run(simulation->usage());
    BOOST_TEST((usage.processor == 5s));
    BOOST_TEST(usage.memory_bytes == 12'300'000U);
    simulation->terminate();
    fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST((fixture.world.run(simulation->usage()) == ProcessUsage()));
}

namespace {

/// The same with docker mode, opened.
struct ContainerFixture : Fixture
{
    ContainerFixture()
        : docker(docker_config(), SimulationLauncherConfig(), docker_facts(), host, files, world.clock,
                 log.logger(), docker_hooks()),
          containers(launcher_setup().config, launcher_setup().facts, host, world.clock, log.logger(),
                     &docker)
    {
        files.texts["/templates/docker-compose-default.yml"] = "services:\n  webots:\n";
        files.texts["/templates/Dockerfile.default"] = "Dockerfile.default";
        expect_commands(1, "Docker Compose version v2\n");
        expect_commands(1, "Docker 26.1.5 has runc \n");
        expect_commands(looks);
        BOOST_TEST_REQUIRE(world.run(docker.open()).has_value());
        began = world.clock.now();
    }

    ~ContainerFixture() { BOOST_TEST(containers.running() == 0u); }

    static DockerConfig docker_config()
    {
        DockerConfig config;
        config.build_cache = 0;
        config.directory = "/templates";
        return config;
    }

    static DockerFacts docker_facts()
    {
        DockerFacts facts;
        facts.docker = "/bin/docker";
        facts.identity = "webots-2000-1f3a9c4d";
        return facts;
    }

    static DockerModeHooks docker_hooks()
    {
        DockerModeHooks hooks;
        hooks.new_token = [] { return std::string(32, '0'); };
        return hooks;
    }

    void expect_commands(int count, std::string output = {}, Duration each = {})
    {
        for (int i = 0; i < count; ++i)
            processes.expect().after(each).prints(output).exits(0);
    }

    static constexpr int looks = 4; ///< Commands that list what was left behind: containers and the like.

    testing::MemoryTextFiles files;
    DockerMode docker;
    SimulationLauncher containers;
};

} // namespace

BOOST_AUTO_TEST_SUITE(with_containers)

BOOST_AUTO_TEST_CASE(a_project_that_can_not_be_prepared_costs_no_port_and_starts_nothing)
{
    ContainerFixture fixture;
    fixture.files.fuse = testing::Fuse(1);
    auto const started = fixture.processes.started().size();
    auto const failed = fixture.world.run(fixture.containers.launch(launch_spec()));
    BOOST_TEST_REQUIRE(!failed.has_value());
    BOOST_TEST(failed.error() == errc::unreachable);
    BOOST_TEST(failed.error().detail() == "the fuse blew");
    BOOST_TEST(fixture.containers.running() == 0u);
    BOOST_TEST(fixture.processes.held() == 0u);
    BOOST_TEST(fixture.processes.started().size() == started);
}

BOOST_AUTO_TEST_CASE(a_compose_that_does_not_start_gives_its_port_back_and_says_why)
{
    ContainerFixture fixture; // with nothing more in the script, the next command fails
    auto const failed = fixture.world.run(fixture.containers.launch(launch_spec()));
    BOOST_TEST_REQUIRE(!failed.has_value());
    BOOST_TEST(failed.error() == errc::start_failed);
    BOOST_TEST(failed.error().detail() ==
               sentence(core::Refused::not_started, {{"why", "/bin/docker is not in the script"}}));
    BOOST_TEST(fixture.containers.running() == 0u);
}

// A browser that leaves at this very moment must not leave containers behind.
BOOST_AUTO_TEST_CASE(the_end_is_told_when_nothing_is_left_even_to_one_who_was_told_not_to_wait)
{
    ContainerFixture fixture;
    fixture.processes.expect().after(1s).exits(1);
    fixture.expect_commands(ContainerFixture::looks, {}, 2s);
    auto launched = fixture.world.run(fixture.containers.launch(launch_spec()));
    BOOST_TEST_REQUIRE(launched.has_value());
    Taken taken;
    auto const task = fixture.tasks.spawn(take_event(**launched, taken));
    fixture.world.advance(2s); // the first of the commands that look runs
    BOOST_TEST_REQUIRE(!taken.has_value());
    async::TaskGroup::cancel(task);
    fixture.world.settle();
    BOOST_TEST(!taken.has_value());
    fixture.world.advance(10s);
    BOOST_TEST_REQUIRE(taken.has_value());
    BOOST_TEST_REQUIRE(taken->has_value());
    BOOST_TEST_REQUIRE(std::holds_alternative<SimulationEnded>(**taken));
    BOOST_TEST((std::get<SimulationEnded>(**taken).status == ExitStatus(1, false)));
}

BOOST_AUTO_TEST_SUITE_END()

BOOST_AUTO_TEST_SUITE_END()
