#include "unit_test.hpp"

#include "core/slurm/job_command.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(job_command)

namespace {

using Words = std::vector<std::string>;

SlurmConfig with_overrides()
{
    SlurmConfig slurm;
    slurm.job.partition = "cpu";
    auto& gpu = slurm.overrides.emplace_back();
    gpu.label = "gpu";
    gpu.job.partition = "gpu";
    auto& pictures = slurm.overrides.emplace_back();
    pictures.mode = "mjpeg";
    pictures.job.partition = "pictures";
    return slurm;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_job_asks_for_what_the_operator_says)
{
    SlurmJobConfig job;
    BOOST_TEST(srun_command("/usr/bin/srun", job, "name", 61s) ==
                   (Words{"/usr/bin/srun", "--job-name=name", "--nodes=1", "--ntasks=1", "--cpus-per-task=1",
                          "--time=2", "--input=none", "--export=ALL", "--mpi=none"}),
               boost::test_tools::per_element());
    job.partition = "p";
    job.account = "a";
    job.qos = "q";
    job.gres = "gpu:1";
    job.memory = (std::uint64_t{512} << 20) + 1;
    job.processors = 4;
    job.time_limit = 1h;
    BOOST_TEST(srun_command("/usr/bin/srun", job, "name", 61s) ==
                   (Words{"/usr/bin/srun", "--job-name=name", "--nodes=1", "--ntasks=1", "--cpus-per-task=4",
                          "--time=60", "--input=none", "--export=ALL", "--mpi=none", "--partition=p",
                          "--account=a", "--qos=q", "--gres=gpu:1", "--mem=513M"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_job_whose_project_is_copied_gets_it_as_input)
{
    auto const words = srun_command("/usr/bin/srun", SlurmJobConfig(), "name", 61s, true);
    BOOST_TEST(words ==
                   (Words{"/usr/bin/srun", "--job-name=name", "--nodes=1", "--ntasks=1", "--cpus-per-task=1",
                          "--time=2", "--input=0", "--export=ALL", "--mpi=none", "--chdir=/"}),
               boost::test_tools::per_element());
    BOOST_TEST(step_command("/usr/bin/srun", "7").at(1) == "--jobid=7");
    BOOST_TEST(job_folder("/tmp", "a_1") == "/tmp/webots-cloud-job.a_1");
}

BOOST_AUTO_TEST_CASE(of_overrides_the_first_that_fits_counts)
{
    auto const slurm = with_overrides();
    BOOST_TEST(job_for(slurm, "x3d", {}).partition == "cpu");
    BOOST_TEST(job_for(slurm, "mjpeg", {}).partition == "pictures");
    BOOST_TEST(job_for(slurm, "mjpeg", {"ros", "gpu"}).partition == "gpu");
    BOOST_TEST(job_for(slurm, "x3d", {"ros"}).partition == "cpu");
}

BOOST_AUTO_TEST_CASE(jobs_that_name_no_partition_are_in_the_standard_one)
{
    auto slurm = with_overrides();
    slurm.overrides.back().job.partition.clear();
    slurm.overrides.emplace_back().job.partition = "gpu";
    name_partitions(slurm, "main");
    BOOST_TEST(slurm.job.partition == "cpu");
    BOOST_TEST(partitions_of(slurm) == (Words{"cpu", "gpu", "main"}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(the_limit_of_jobs_is_longer_than_simulations_may_run)
{
    SimulationLauncherConfig launching;
    launching.timeout = 2h;
    launching.extendable = 1h;
    launching.start_timeout = 5min;
    BOOST_TEST((job_time_limit(launching) > 3h + 5min));
}

BOOST_AUTO_TEST_CASE(the_names_of_jobs_tell_servers_apart)
{
    BOOST_TEST(job_identity("robots.example.org", 2000) == "webots_cloud_robots_2000_");
    BOOST_TEST(job_identity("robots", 2001) == "webots_cloud_robots_2001_");
}

BOOST_AUTO_TEST_SUITE_END()
