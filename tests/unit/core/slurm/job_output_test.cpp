#include "unit_test.hpp"

#include "core/refusals.hpp"
#include "core/slurm/job_output.hpp"

using namespace webots_cloud::core;

BOOST_TEST_DONT_PRINT_LOG_VALUE(JobOutput::Line)

BOOST_AUTO_TEST_SUITE(job_output)

using Line = JobOutput::Line;

namespace {

constexpr auto on_node7 = "webots-process-guard 5f0c9a4b7d21e836 runs on node7 in 12";

/// The sentence itself is the table's.
bool is_reason(JobOutput const& job, Refused why, std::string_view words = "")
{
    return job.reason().message() == refused(why, {{"words", words}}).message();
}

/// Whether a job that printed this line, while it ran or before, has ended for that reason.
bool ends(std::string_view line, Refused why, std::string_view words = "", bool runs = true)
{
    JobOutput job;
    if (runs)
        job.read(on_node7);
    return job.read(line) == Line::ends && is_reason(job, why, words);
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

BOOST_AUTO_TEST_CASE(it_is_known_why_slurm_ends_a_job)
{
    std::string const step =
        "slurmstepd-node1: error: *** STEP 6.0 ON node1 CANCELLED AT 2026-11-24T03:01:30 ";
    BOOST_TEST(ends(step + "DUE TO PREEMPTION ***", Refused::job_preempted));
    BOOST_TEST(ends(step + "DUE TO TIME LIMIT ***", Refused::job_time_limit));
    BOOST_TEST(ends(step + "***", Refused::job_cancelled));
    BOOST_TEST(ends("srun: error: Node failure on node1", Refused::node_failed));
    BOOST_TEST(ends("slurmstepd: error: Detected 1 oom-kill event(s) in StepId=3.0.", Refused::job_memory));
    BOOST_TEST(
        ends("slurmstepd-node1: error: couldn't chdir to `/x': No such file or directory: going to /tmp "
             "instead",
             Refused::node_without_project, "", false));
    for (auto const* other : {"srun: Job step aborted: Waiting up to 7 seconds for job step to finish.",
                              "srun: error: node1: task 0: Killed"}) {
        JobOutput job;
        job.read(on_node7);
        BOOST_TEST((job.read(other) != Line::ends), other);
    }
}

BOOST_AUTO_TEST_CASE(it_is_known_why_slurm_starts_no_job)
{
    BOOST_TEST(ends("srun: error: Unable to allocate resources: Invalid partition name specified",
                    Refused::job_refused, "Invalid partition name specified", false));
    BOOST_TEST(ends("srun: error: Invalid generic resource (gres) specification", Refused::job_invalid,
                    "generic resource (gres) specification", false));
    BOOST_TEST(ends("srun: Job allocation 4 has been revoked", Refused::job_cancelled_early, "", false));
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

BOOST_AUTO_TEST_CASE(why_a_project_can_not_be_copied_is_told_without_our_paths)
{
    JobOutput on_the_node;
    on_the_node.read(on_node7);
    on_the_node.read("webots-process-guard 5f0c9a4b7d21e836 receives 0");
    BOOST_TEST(
        (on_the_node.read("tar: srv/1/a: b/c.wbt: Cannot write: No space left on device") == Line::ours));
    on_the_node.read("tar: Exiting with failure status due to previous errors");
    BOOST_TEST((on_the_node.read("webots-process-guard 5f0c9a4b7d21e836 can't receive") == Line::ends));
    BOOST_TEST(is_reason(on_the_node, Refused::job_project_not_copied_saying, "No space left on device"));
    JobOutput here;
    BOOST_TEST((here.read("webots-process-guard can't send") == Line::ends));
    BOOST_TEST(is_reason(here, Refused::job_project_not_copied));
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
