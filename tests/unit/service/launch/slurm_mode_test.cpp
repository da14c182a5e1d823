#include "refusal_sentences.hpp"
#include "service/setups.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/load/load_formula.hpp"

#include <webots_cloud/simulation_launcher.hpp>
#include <webots_cloud/slurm_mode.hpp>
#include <webots_cloud/testing/fixed_metrics.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_processes.hpp>
#include <webots_cloud/testing/world.hpp>

#include <boost/asio/this_coro.hpp>

#include <algorithm>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(slurm_mode)

namespace {

constexpr auto two_nodes = "n1 10.0.0.1 1/1/0/2 1000 500\nn2 n2.cluster 0/2/0/2 1000 0\n";
constexpr auto on_n2 = "webots-process-guard 5f0c9a4b7d21e836 runs on n2 in 4\n";

struct SlurmSetup
{
    SlurmConfig config;
    SlurmFacts facts;
};

SlurmSetup slurm_setup()
{
    SlurmSetup setup;
    setup.facts.srun = "/bin/srun";
    setup.facts.scancel = "/bin/scancel";
    setup.facts.squeue = "/bin/squeue";
    setup.facts.sinfo = "/bin/sinfo";
    setup.facts.getent = "/bin/getent";
    setup.facts.tar = "/bin/tar";
    setup.facts.guard = "/bin/guard";
    setup.facts.identity = "webots_cloud_h_2000_";
    setup.facts.run = "r";
    setup.facts.environment = {{"PATH", "/bin"}, {"SECRET", "x"}, {"SLURM_CONF", "/etc/s.conf"}};
    return setup;
}

LauncherSetup launcher_with_jobs()
{
    LauncherSetup setup;
    setup.facts.webots = "/opt/webots/webots";
    setup.config.timeout = 600s;
    setup.config.start_timeout = 300s;
    setup.config.gateway = true;
    return setup;
}

struct SlurmFixture
{
    explicit SlurmFixture(SlurmSetup const& setup = slurm_setup())
        : slurm(setup.config, setup.facts, processes, world.clock, log.logger()),
          launcher(launcher_with_jobs().config, launcher_with_jobs().facts, processes, world.clock,
                   log.logger(), nullptr, &slurm)
    {}

    ~SlurmFixture()
    {
        BOOST_TEST(processes.alive() == 0);
        BOOST_TEST(launcher.running() == 0u);
    }

    std::string open()
    {
        auto const opened = world.run(slurm.open());
        return opened ? "" : opened.error().message();
    }

    /// With two nodes and these jobs.
    void open_with(std::string jobs = {})
    {
        processes.expect().prints("main*\n").exits(0);
        processes.expect().prints(two_nodes).exits(0);
        processes.expect().prints(std::move(jobs)).exits(0);
    }

    std::unique_ptr<Simulation> launched()
    {
        LaunchSpec spec;
        spec.instance = "/instances/1";
        spec.root = spec.instance;
        spec.world = "/instances/1/worlds/a.wbt";
        spec.label = "1";
        auto simulation = world.run(launcher.launch(std::move(spec)));
        BOOST_TEST_REQUIRE(simulation.has_value());
        return std::move(*simulation);
    }

    template<class Event>
    Event next(Simulation& simulation)
    {
        auto const event = world.run(simulation.next_event());
        BOOST_TEST_REQUIRE(event.has_value());
        BOOST_TEST_REQUIRE(std::holds_alternative<Event>(*event), "event " << event->index());
        return std::get<Event>(*event);
    }

    std::vector<std::string> arguments(std::size_t number) const
    {
        return processes.started().at(number).argv;
    }

    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedProcesses processes{world.clock};
    SlurmMode slurm;
    SimulationLauncher launcher;
};

bool has_word(std::vector<std::string> const& words, std::string_view word)
{
    return std::ranges::find(words, word) != words.end();
}

asio::awaitable<void> run_slurm(SlurmMode& slurm)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    (void)co_await slurm.run();
}

} // namespace

BOOST_AUTO_TEST_CASE(at_the_start_jobs_of_an_earlier_run_are_ended)
{
    SlurmFixture fixture;
    fixture.open_with("7|RUNNING|None|0|webots_cloud_h_2000_old_1_1\n8|RUNNING|None|0|theirs\n");
    fixture.processes.expect().prints("7|RUNNING|None|0|webots_cloud_h_2000_old_1_1\n").exits(0); // of ours
    fixture.processes.expect().exits(0);
    BOOST_TEST(fixture.open() == "");
    BOOST_TEST(has_word(fixture.arguments(3), "--me"));
    BOOST_TEST(fixture.arguments(4) == (std::vector<std::string>{"/bin/scancel", "--", "7"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.log.contains("Simulations are jobs of Slurm, in main: 2 nodes, 4 processors"));
    for (auto const& [name, value] : fixture.processes.started().at(0).environment)
        BOOST_TEST(name != "SECRET");
}

// Another user's job whose name has a line break in it, or is named as ours are.
BOOST_AUTO_TEST_CASE(rows_that_others_have_forged_end_nothing)
{
    SlurmFixture fixture;
    fixture.open_with("8|RUNNING|None|0|theirs\n7|RUNNING|None|0|webots_cloud_h_2000_old_1_1\n"
                      "--me|RUNNING|None|0|webots_cloud_h_2000_old_1_2\n");
    fixture.processes.expect().prints("5|RUNNING|None|0|other work of ours\n").exits(0);
    BOOST_TEST(fixture.open() == "");
    BOOST_TEST(fixture.processes.started().size() == 4u, "nothing is cancelled");
}

BOOST_AUTO_TEST_CASE(what_is_missing_is_told_at_the_start)
{
    auto without_srun = slurm_setup();
    without_srun.facts.srun.clear();
    SlurmFixture first(without_srun);
    BOOST_TEST(first.open() == "srun is not installed, which \"launcher\" needs (slurm-client).");

    auto elsewhere = slurm_setup();
    elsewhere.config.job.partition = "gpu";
    SlurmFixture second(elsewhere);
    second.processes.expect().prints("main*\n").exits(0);
    BOOST_TEST(second.open() ==
               "Slurm has no partition \"gpu\" that this server's user may use: see \"launcher\".");

    SlurmFixture third;
    third.processes.expect().prints("main\n").exits(0);
    BOOST_TEST(third.open() ==
               "Slurm has no default partition: name one with \"partition\" of \"launcher\".");

    auto without_tar = slurm_setup();
    without_tar.facts.tar.clear();
    without_tar.config.copy_to = "/tmp";
    SlurmFixture copying(without_tar);
    BOOST_TEST(copying.open() == "tar is not installed, which \"copyTo\" of \"launcher\" needs.");

    SlurmFixture fourth;
    fourth.processes.expect().prints("Unable to contact slurm controller (connect failure)\n").exits(1);
    BOOST_TEST(fourth.open() ==
               "Slurm does not answer: Unable to contact slurm controller (connect failure)");
}

BOOST_AUTO_TEST_CASE(a_job_waits_without_a_limit_and_is_ready_at_the_address_of_its_node)
{
    SlurmFixture fixture;
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    fixture.processes.expect()
        .prints("srun: job 4 queued and waiting for resources\n")
        .after(3600s)
        .prints(on_n2)
        .after(100s)
        .prints(".\n")
        .after(1s)
        .prints("webots-process-guard 5f0c9a4b7d21e836 listens on 2003\n")
        .after(1000s)
        .exits(0);
    fixture.processes.expect().prints("10.0.0.2       STREAM n2.cluster\n").exits(0);
    auto const began = fixture.world.clock.now();
    auto const simulation = fixture.launched();

    auto const& process = fixture.processes.started().at(3);
    BOOST_TEST(process.remote.command.at(1) == "--job-name=webots_cloud_h_2000_r_1_1");
    BOOST_TEST(has_word(process.remote.command, "--partition=main"));
    BOOST_TEST(has_word(process.remote.command, "--time=17")); // the launcher's limits, and 2 minutes
    BOOST_TEST(process.remote.first_port == 2001);
    BOOST_TEST(process.argv.front() == "/opt/webots/webots");
    BOOST_TEST(process.cleanup_command ==
                   (std::vector<std::string>{"/bin/scancel", "--quiet", "--name=webots_cloud_h_2000_r_1_1"}),
               boost::test_tools::per_element());

    fixture.next<SimulationAllocated>(*simulation);
    BOOST_TEST((simulation->ends_at() == began + 3600s + 600s));
    auto const ready = fixture.next<SimulationReady>(*simulation);
    BOOST_TEST(ready.port == 2003);
    BOOST_TEST(ready.host == "10.0.0.2");
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST(ended.reason.message() == sentence(core::Refused::time_limit, {{"seconds", "600"}}));
}

BOOST_AUTO_TEST_CASE(who_waits_hears_what_slurm_says_and_that_it_says_nothing)
{
    SlurmFixture fixture;
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    fixture.processes.expect()
        .prints("srun: job 4 queued and waiting for resources\n")
        .after(60s)
        .prints("srun: Job allocation 4 has been revoked\n")
        .exits(1);
    auto const simulation = fixture.launched();
    fixture.processes.expect().prints(two_nodes).exits(0);
    fixture.processes.expect().prints("4|PENDING|Resources|N/A|webots_cloud_h_2000_r_1_1\n").exits(0);
    fixture.processes.expect().prints("Unable to contact slurm controller\n").exits(1);
    async::TaskGroup tasks(fixture.world.executor());
    auto const task = tasks.spawn(run_slurm(fixture.slurm));
    BOOST_TEST(fixture.next<SimulationProgress>(*simulation).text ==
               "Waiting for a free node of the cluster: position 1 of 1.");
    BOOST_TEST(fixture.next<SimulationProgress>(*simulation).text ==
               "Waiting for a free node of the cluster, whose scheduler does not answer at the moment.");
    BOOST_TEST(fixture.log.contains("Slurm does not answer: Unable to contact slurm controller"));
    async::TaskGroup::cancel(task);
    fixture.world.settle();
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST(ended.reason.message() ==
               "The simulation was cancelled while it waited for a node of the cluster.");
}

BOOST_AUTO_TEST_CASE(a_job_that_has_outlived_its_simulation_is_ended)
{
    SlurmFixture fixture;
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    fixture.processes.expect().prints(on_n2).after(1s).crashes(9);
    {
        auto const simulation = fixture.launched();
        fixture.next<SimulationEnded>(*simulation);
    }
    fixture.processes.expect().prints(two_nodes).exits(0);
    fixture.processes.expect().prints("4|RUNNING|None|0|webots_cloud_h_2000_r_1_1\n").exits(0);
    fixture.processes.expect().prints("4|RUNNING|None|0|webots_cloud_h_2000_r_1_1\n").exits(0); // of ours
    fixture.processes.expect().exits(0);
    fixture.processes.expect().prints(two_nodes).exits(0);
    fixture.processes.expect().exits(0);
    fixture.processes.expect().prints(two_nodes).exits(0); // nothing is left: squeue is not asked any more
    async::TaskGroup tasks(fixture.world.executor());
    auto const task = tasks.spawn(run_slurm(fixture.slurm));
    fixture.world.advance(16s);
    BOOST_TEST(fixture.arguments(7) == (std::vector<std::string>{"/bin/scancel", "--", "4"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.processes.started().size() == 11u);
    BOOST_TEST(fixture.arguments(10).front() == "/bin/sinfo");
    async::TaskGroup::cancel(task);
    fixture.world.settle();
}

BOOST_AUTO_TEST_CASE(a_signal_that_ends_the_simulator_is_told_as_on_this_machine)
{
    SlurmFixture fixture;
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    fixture.processes.expect()
        .prints("webots-process-guard 5f0c9a4b7d21e836 runs on n1 in 4\n.\n"
                "webots-process-guard 5f0c9a4b7d21e836 listens on 2001\n")
        .after(1s)
        .exits(139);
    auto const simulation = fixture.launched();
    BOOST_TEST(fixture.next<SimulationReady>(*simulation).host == "10.0.0.1");
    BOOST_TEST(fixture.next<SimulationEnded>(*simulation).reason.message() ==
               sentence(core::Refused::crashed, {{"how", "it was ended by signal 11"}}));
}

BOOST_AUTO_TEST_CASE(who_claims_to_listen_elsewhere_is_not_believed)
{
    SlurmFixture fixture;
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    fixture.processes.expect()
        .prints("webots-process-guard 5f0c9a4b7d21e836 runs on n1 in 4\n.\n"
                "webots-process-guard 5f0c9a4b7d21e836 listens on 22\n")
        .after(1s)
        .exits(1);
    fixture.processes.expect()
        .prints("webots-process-guard 5f0c9a4b7d21e836 runs on 192.0.2.1 in 4\n.\n"
                "webots-process-guard 5f0c9a4b7d21e836 listens on 2002\n")
        .after(1000s)
        .exits(0);
    auto const first = fixture.launched();
    auto const second = fixture.launched();
    BOOST_TEST(!fixture.next<SimulationEnded>(*first).was_ready);
    BOOST_TEST(fixture.next<SimulationEnded>(*second).reason.message() ==
               "The simulation runs on 192.0.2.1, but this server knows no address of it.");
}

BOOST_AUTO_TEST_CASE(what_a_job_uses_is_what_the_guard_on_its_node_counts)
{
    auto setup = slurm_setup();
    setup.config.job.memory = 5000;
    SlurmFixture fixture(setup);
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    fixture.processes.expect()
        .prints(on_n2)
        .after(1s)
        .prints("webots-process-guard 5f0c9a4b7d21e836 uses 1500 9000 5000 7 1 0 0\n.\n"
                "webots-process-guard 5f0c9a4b7d21e836 listens on 2001\n")
        .after(1s)
        .prints("webots-process-guard 5f0c9a4b7d21e836 uses 1500 9000 5001 7 1 0 0\n")
        .after(1000s)
        .exits(0);
    fixture.processes.expect().prints("10.0.0.2       STREAM n2.cluster\n").exits(0);
    auto const simulation = fixture.launched();
    BOOST_TEST((fixture.world.run(simulation->usage()) == ProcessUsage()));
    fixture.next<SimulationReady>(*simulation);
    auto const used = fixture.world.run(simulation->usage());
    BOOST_TEST((used.processor == 1500ms));
    BOOST_TEST(used.memory_bytes == 9000u);
    BOOST_TEST(used.processes == 7u);
    BOOST_TEST(used.counted.has_value());
    auto const ended = fixture.next<SimulationEnded>(*simulation);
    BOOST_TEST((ended.overrun == Limit::memory));
    BOOST_TEST(ended.reason.message() == sentence(core::Refused::job_memory_overrun, {{"max", "0"}}));
}

BOOST_AUTO_TEST_CASE(a_project_is_copied_where_the_node_does_not_see_it)
{
    auto setup = slurm_setup();
    setup.config.copy_to = "/scratch";
    SlurmFixture fixture(setup);
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    fixture.processes.expect()
        .prints(on_n2)
        .prints("webots-process-guard 5f0c9a4b7d21e836 receives 2500000\n")
        .after(1s)
        .prints("webots-process-guard 5f0c9a4b7d21e836 has received\n")
        .after(1s)
        .exits(1);
    auto const simulation = fixture.launched();
    auto const process = fixture.processes.started().at(3);
    BOOST_TEST(process.remote.copied_to == "/scratch/webots-cloud-job.webots_cloud_h_2000_r_1_1");
    BOOST_TEST((process.remote.copied == std::vector<std::filesystem::path>{"/instances/1"}));
    BOOST_TEST(process.directory == "/scratch/webots-cloud-job.webots_cloud_h_2000_r_1_1/instances/1/worlds");
    BOOST_TEST(process.argv.back() ==
               "/scratch/webots-cloud-job.webots_cloud_h_2000_r_1_1/instances/1/worlds/a.wbt");
    BOOST_TEST(has_word(process.remote.command, "--input=0"));
    BOOST_TEST(fixture.world.run(simulation->put_back("/instances/1/controllers/c/c.py")).has_value());
    BOOST_TEST(fixture.processes.started().size() == 4u); // it does not run yet
    BOOST_TEST(fixture.next<SimulationProgress>(*simulation).text ==
               "Copying the project to its node of the cluster (2.5 MB)");

    fixture.processes.expect().exits(0);
    BOOST_TEST(fixture.world.run(simulation->put_back("/instances/1/controllers/c/c.py")).has_value());
    auto const& put = fixture.processes.started().at(4);
    BOOST_TEST(put.remote.command.at(1) == "--jobid=4");
    BOOST_TEST((put.remote.copied == std::vector<std::filesystem::path>{"/instances/1/controllers/c/c.py"}));
    BOOST_TEST(put.argv == (std::vector<std::string>{"/bin/guard", "--put", put.remote.copied_to.native(),
                                                     process.remote.copied_to.native(),
                                                     "instances/1/controllers/c/c.py"}),
               boost::test_tools::per_element());
    fixture.next<SimulationEnded>(*simulation);
}

BOOST_AUTO_TEST_CASE(the_load_is_that_of_the_nodes)
{
    SlurmFixture fixture;
    fixture.open_with();
    BOOST_TEST(fixture.open() == "");
    testing::FixedMetrics machine;
    auto const metrics = fixture.slurm.metrics(machine);
    BOOST_TEST(metrics->description().cores == 4);
    BOOST_TEST(metrics->description().memory_bytes == std::uint64_t{2000} << 20);
    auto const before = metrics->sample();
    auto const after = metrics->sample();
    BOOST_TEST(core::cpu_percent(before, after) == 25);
    BOOST_TEST(after.memory_used == 25);
}

BOOST_AUTO_TEST_SUITE_END()
