#include "unit_test.hpp"

#include "core/slurm/job_output.hpp"

using namespace webots_cloud::core;

BOOST_TEST_DONT_PRINT_LOG_VALUE(JobOutput::Line)

BOOST_AUTO_TEST_SUITE(job_output)

using Line = JobOutput::Line;

namespace {

constexpr auto on_node7 = "webots-process-guard 5f0c9a4b7d21e836 runs on node7 in 12";

/// Why a job has ended that printed this line, while it ran or before.
std::string reason_of(std::string_view line, bool runs = true)
{
    JobOutput job;
    if (runs)
        job.read(on_node7);
    return job.read(line) == Line::ends ? job.reason().message() : std::string();
}

} // namespace

BOOST_AUTO_TEST_CASE(a_job_waits_runs_and_listens)
{
    JobOutput job;
    BOOST_TEST((job.read("srun: job 4 queued and waiting for resources") == Line::waits));
    BOOST_TEST((job.read("srun: job 4 has been allocated resources") == Line::ours));
    BOOST_TEST((job.read(on_node7) == Line::runs));
    BOOST_TEST(job.node() == "node7");
    BOOST_TEST(job.number() == "12");
    BOOST_TEST((job.read("INFO: starting controller") == Line::simulators));
    BOOST_TEST((job.read(".") == Line::simulators));
    BOOST_TEST(job.port() == 0);
    BOOST_TEST((job.read("webots-process-guard 5f0c9a4b7d21e836 listens on 2003") == Line::listens));
    BOOST_TEST(job.port() == 2003);
}

BOOST_AUTO_TEST_CASE(a_simulator_can_say_neither_where_it_is_nor_where_it_listens)
{
    JobOutput job;
    BOOST_TEST((job.read("webots-process-guard 0000000000000000 listens on 22") == Line::simulators));
    job.read(on_node7);
    BOOST_TEST((job.read("webots-process-guard 0000000000000000 runs on other in 1") == Line::simulators));
    BOOST_TEST((job.read("webots-process-guard 0000000000000000 listens on 22") == Line::simulators));
    BOOST_TEST((job.read("webots-process-guard 0000000000000000 uses 1 2 3 4 1 6 0") == Line::simulators));
    BOOST_TEST((job.read("webots-process-guard can't send") == Line::simulators));
    BOOST_TEST((job.read("tar: x: it is the simulator that says so") == Line::simulators));
    BOOST_TEST((job.read("webots-process-guard") == Line::simulators));
    BOOST_TEST(job.node() == "node7");
    BOOST_TEST(job.port() == 0);
}

BOOST_AUTO_TEST_CASE(why_slurm_ends_a_job_is_a_sentence)
{
    BOOST_TEST(
        reason_of("slurmstepd-node1: error: *** STEP 6.0 ON node1 CANCELLED AT 2026-11-24T03:01:30 DUE TO "
                  "PREEMPTION ***") ==
        "The simulation was ended by Slurm, which needs its node for a more important job.");
    BOOST_TEST(
        reason_of("slurmstepd: error: *** STEP 6.0 ON node1 CANCELLED AT 2026-11-24T03:01:30 DUE TO TIME "
                  "LIMIT ***") == "The simulation was ended by Slurm: its job has reached its time limit.");
    BOOST_TEST(reason_of("srun: error: Node failure on node1") ==
               "The simulation has ended: its node of the cluster has failed.");
    BOOST_TEST(
        reason_of("slurmstepd: error: Detected 1 oom-kill event(s) in StepId=3.0.") ==
        "The simulation was ended: it needed more memory than its job may have. Its operator can raise "
        "\"memory\" of \"launcher\".");
    BOOST_TEST(
        reason_of("slurmstepd-node1: error: *** STEP 3.0 ON node1 CANCELLED AT 2026-11-24T03:01:29 ***") ==
        "The simulation was ended: its job was cancelled.");
    BOOST_TEST(
        reason_of("slurmstepd-node1: error: couldn't chdir to `/x': No such file or directory: going to /tmp "
                  "instead",
                  false) ==
        "The node of the cluster does not see the simulation's project: the folder \"stateDir\" of the "
        "simulation server must be shared with all nodes, or projects be copied to them (\"copyTo\" of "
        "\"launcher\").");
    BOOST_TEST(reason_of("srun: Job step aborted: Waiting up to 7 seconds for job step to finish.") == "");
    BOOST_TEST(reason_of("srun: error: node1: task 0: Killed") == "");
}

BOOST_AUTO_TEST_CASE(why_slurm_starts_no_job_is_a_sentence)
{
    BOOST_TEST(reason_of("srun: error: Unable to allocate resources: Invalid partition name specified",
                         false) == "Slurm does not start the simulation: Invalid partition name specified.");
    BOOST_TEST(reason_of("srun: error: Invalid generic resource (gres) specification", false) ==
               "Slurm does not start the simulation: invalid generic resource (gres) specification.");
    BOOST_TEST(reason_of("srun: Job allocation 4 has been revoked", false) ==
               "The simulation was cancelled while it waited for a node of the cluster.");
}

BOOST_AUTO_TEST_CASE(the_guard_counts_what_the_simulator_uses)
{
    JobOutput job;
    job.read(on_node7);
    BOOST_TEST(
        (job.read("webots-process-guard 5f0c9a4b7d21e836 uses 1500 3000 2000 7 0 4096 1") == Line::uses));
    auto const& used = job.usage();
    BOOST_TEST((used.processor == std::chrono::milliseconds(1500)));
    BOOST_TEST(used.memory == 3000u);
    BOOST_TEST(used.own_memory == 2000u);
    BOOST_TEST(used.processes == 7u);
    BOOST_TEST(!used.complete);
    BOOST_TEST(used.disk == 4096u);
    BOOST_TEST(used.too_many_files);
    BOOST_TEST((job.read("webots-process-guard 5f0c9a4b7d21e836 uses") == Line::simulators));
    BOOST_TEST((job.read("webots-process-guard 5f0c9a4b7d21e836 uses x") == Line::uses));
    BOOST_TEST(job.usage().memory == 0u);
}

BOOST_AUTO_TEST_CASE(a_project_is_copied_before_the_simulator_starts)
{
    JobOutput job;
    job.read(on_node7);
    BOOST_TEST((job.read("webots-process-guard 5f0c9a4b7d21e836 receives 12345678") == Line::receives));
    BOOST_TEST(copying_text(job.usage().received) ==
               "Copying the project to its node of the cluster (12.3 MB)");
    BOOST_TEST((job.read("webots-process-guard 5f0c9a4b7d21e836 has received") == Line::ours));
    BOOST_TEST((job.read("tar: x: it is the simulator that says so") == Line::simulators));
}

BOOST_AUTO_TEST_CASE(why_a_project_can_not_be_copied_is_a_sentence_without_our_paths)
{
    JobOutput on_the_node;
    on_the_node.read(on_node7);
    on_the_node.read("webots-process-guard 5f0c9a4b7d21e836 receives 0");
    BOOST_TEST(
        (on_the_node.read("tar: srv/1/a: b/c.wbt: Cannot write: No space left on device") == Line::ours));
    on_the_node.read("tar: Exiting with failure status due to previous errors");
    BOOST_TEST((on_the_node.read("webots-process-guard 5f0c9a4b7d21e836 can't receive") == Line::ends));
    BOOST_TEST(on_the_node.reason().message() ==
               "The simulation's project can't be copied to its node of the cluster: No "
               "space left on device. Please tell the operator.");
    JobOutput here;
    BOOST_TEST((here.read("webots-process-guard can't send") == Line::ends));
    BOOST_TEST(here.reason().message() ==
               "The simulation's project can't be copied to its node of the cluster. Please tell "
               "the operator.");
}

BOOST_AUTO_TEST_CASE(the_first_reason_counts)
{
    JobOutput job;
    job.read("srun: Job has been cancelled");
    auto const first = job.reason().message();
    BOOST_TEST(
        (job.read("srun: error: Unable to allocate resources: Job/step already completing or completed") ==
         Line::ends));
    BOOST_TEST(job.reason().message() == first);
}

BOOST_AUTO_TEST_SUITE_END()
