#include "refusal_sentences.hpp"
#include "unit_test.hpp"

#include "core/sandbox/limits.hpp"

#include <csignal>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(limits)

namespace {

constexpr std::uint64_t megabyte = std::uint64_t{1} << 20;
constexpr std::uint64_t gigabyte = std::uint64_t{1} << 30;

ProcessLimits all_limits()
{
    ProcessLimits limits;
    limits.memory = 200 * megabyte;
    limits.processors = 1.5;
    limits.processes = 50;
    limits.files = 100;
    limits.disk = 10 * megabyte;
    return limits;
}

LimitSupport with_groups()
{
    LimitSupport support;
    support.memory = support.processes = support.processors = true;
    support.version = 2;
    return support;
}

bool contains(std::string const& text, std::string_view part)
{
    return text.find(part) != std::string::npos;
}

} // namespace

BOOST_AUTO_TEST_CASE(without_keys_a_simulation_gets_a_share_of_the_machine_that_webots_can_work_with)
{
    LimitsConfig const config;
    BOOST_TEST(simulation_limits(config, 4 * gigabyte, 4).memory == 2 * gigabyte);
    BOOST_TEST(simulation_limits(config, 32 * gigabyte, 4).memory == 8 * gigabyte);
    BOOST_TEST(simulation_limits(config, 512 * gigabyte, 4).memory == 16 * gigabyte);
    BOOST_TEST(simulation_limits(config, gigabyte, 4).processes == 1280U);
    BOOST_TEST(simulation_limits(config, gigabyte, 0).processes == 1088U);
    BOOST_TEST(simulation_limits(config, gigabyte, 4).processors == 0);
    BOOST_TEST(simulation_limits(config, gigabyte, 4).files == 4096U);
    BOOST_TEST(simulation_limits(config, gigabyte, 4).disk == 4 * gigabyte);
}

BOOST_AUTO_TEST_CASE(what_the_configuration_says_counts_and_0_is_no_limit)
{
    LimitsConfig config;
    config.memory = 5;
    config.processes = 0;
    config.processors = 2;
    config.files = 0;
    config.disk = 0;
    auto const limits = simulation_limits(config, 64 * gigabyte, 8);
    BOOST_TEST(limits.memory == 5U);
    BOOST_TEST(limits.processes == 0U);
    BOOST_TEST(limits.processors == 2);
    BOOST_TEST(limits.any());
    config.memory = 0;
    config.processors = 0;
    BOOST_TEST(!simulation_limits(config, 64 * gigabyte, 8).any());
}

BOOST_AUTO_TEST_CASE(each_limit_is_overrun_by_more_than_it_allows)
{
    auto const limits = all_limits();
    Consumption used;
    used.memory = limits.memory;
    used.processes = limits.processes;
    used.disk = limits.disk;
    BOOST_TEST(!overrun(limits, used));
    auto more = used;
    ++more.memory;
    BOOST_TEST((overrun(limits, more) == Limit::memory));
    more = used;
    ++more.processes;
    BOOST_TEST((overrun(limits, more) == Limit::processes));
    more = used;
    ++more.disk;
    BOOST_TEST((overrun(limits, more) == Limit::disk));
    more = used;
    more.images = limits.disk;
    BOOST_TEST(!overrun(limits, more));
    ++more.images;
    BOOST_TEST((overrun(limits, more) == Limit::build));
    BOOST_TEST(!overrun(ProcessLimits(), more));
    more = used;
    more.too_many_files = true;
    BOOST_TEST((overrun(limits, more) == Limit::disk));
}

BOOST_AUTO_TEST_CASE(what_the_kernel_refuses_is_an_overrun)
{
    Consumption killed;
    killed.memory_kills = 1;
    BOOST_TEST((overrun(all_limits(), killed) == Limit::memory));
    Consumption refused;
    refused.refused_forks = 1;
    BOOST_TEST((overrun(all_limits(), refused) == Limit::processes));
}

BOOST_AUTO_TEST_CASE(without_a_limit_nothing_is_overrun)
{
    Consumption used;
    used.memory = used.processes = used.disk = used.memory_kills = used.refused_forks = ~std::uint64_t{0};
    used.too_many_files = true;
    BOOST_TEST(!overrun(ProcessLimits(), used));
}

BOOST_AUTO_TEST_CASE(the_end_at_the_largest_file_is_known_by_signal_and_by_status)
{
    BOOST_TEST(ended_at_file_size(SIGXFSZ, true));
    BOOST_TEST(ended_at_file_size(128 + SIGXFSZ, false));
    BOOST_TEST(!ended_at_file_size(SIGXFSZ, false));
    BOOST_TEST(!ended_at_file_size(SIGKILL, true));
}

BOOST_AUTO_TEST_CASE(the_browser_is_told_the_limit_and_what_helps)
{
    BOOST_TEST(overrun_failure(Limit::memory, all_limits()).message() ==
               sentence(Refused::memory_overrun, {{"max", "200"}}));
    BOOST_TEST(overrun_failure(Limit::memory, all_limits(), true).message() ==
               sentence(Refused::job_memory_overrun, {{"max", "200"}}));
    BOOST_TEST(overrun_failure(Limit::processes, all_limits()).message() ==
               sentence(Refused::process_overrun, {{"max", "50"}}));
    BOOST_TEST(overrun_failure(Limit::disk, all_limits()).message() ==
               sentence(Refused::disk_overrun, {{"max", "10"}}));
}

BOOST_AUTO_TEST_CASE(the_log_says_who_keeps_which_limit)
{
    BOOST_TEST(limits_text(all_limits(), with_groups()) ==
               "The limits of each simulation: 200 MB of memory (control groups, version 2), 1.5 processors "
               "(control groups, version 2), 50 processes and threads (control groups, version 2), 100 open "
               "files of each process, 10 MB on disk (looked at every second).");
    BOOST_TEST(limits_text(all_limits(), LimitSupport()) ==
               "The limits of each simulation: 200 MB of memory (looked at every second), 50 processes and "
               "threads (looked at every second), 100 open files of each process, 10 MB on disk (looked at "
               "every second).");
    BOOST_TEST(contains(limits_text(ProcessLimits(), with_groups()), "no limits"));
}

BOOST_AUTO_TEST_CASE(limits_that_are_not_kept_as_they_should_are_warned_of_with_the_reason)
{
    LimitSupport nothing;
    nothing.problem = "it is read-only";
    CountedMemory in_sandbox;
    in_sandbox.private_folders = true;
    BOOST_TEST(
        unkept_limits(all_limits(), nothing, in_sandbox) ==
        "Simulations can exceed some of their limits, since this server can make no control groups for "
        "these (it is read-only): memory and processes are looked at every second only, in which a "
        "simulation can use much more; memory that no process shows, such as the buffers of sockets, is "
        "not counted; \"simulationCpus\" has no effect (docs/sandboxes.md, \"Limits\").");
    BOOST_TEST(
        contains(unkept_limits(all_limits(), nothing, CountedMemory()), "such as /dev/shm, are not counted"));
    BOOST_TEST(unkept_limits(all_limits(), with_groups(), CountedMemory()) == "");
    BOOST_TEST(unkept_limits(ProcessLimits(), nothing, CountedMemory()) == "");
    auto memory_alone = with_groups();
    memory_alone.memory = false;
    BOOST_TEST(contains(unkept_limits(all_limits(), memory_alone, in_sandbox), ": memory is looked at"));
    BOOST_TEST(!contains(unkept_limits(all_limits(), memory_alone, in_sandbox), "simulationCpus"));
    in_sandbox.open_files = false;
    BOOST_TEST(contains(unkept_limits(all_limits(), nothing, in_sandbox),
                        "files in memory without a name are counted as far as they are mapped only"));
    BOOST_TEST(unkept_limits(all_limits(), with_groups(), in_sandbox) == "");
}

BOOST_AUTO_TEST_CASE(of_jobs_the_log_says_what_slurm_alone_can_limit)
{
    BOOST_TEST(contains(unkept_job_limits(all_limits()), "of memory only a job's own pages are counted"));
    BOOST_TEST(unkept_job_limits(ProcessLimits()) == "");
}

BOOST_AUTO_TEST_CASE(limits_hold_where_the_kernel_keeps_them_and_none_is_missing)
{
    BOOST_TEST(limits_hold(all_limits(), with_groups()));
    BOOST_TEST(!limits_hold(all_limits(), LimitSupport()));
    BOOST_TEST(!limits_hold(ProcessLimits(), with_groups()));
    auto limits = all_limits();
    limits.disk = 0;
    BOOST_TEST(!limits_hold(limits, with_groups()));
}

BOOST_AUTO_TEST_SUITE_END()
