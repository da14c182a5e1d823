#include "unit_test.hpp"

#include "core/sandbox/control_groups.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(control_groups)

namespace {

constexpr std::string_view both_versions =
    "31 23 0:28 / /sys/fs/cgroup rw,relatime - tmpfs tmpfs rw,mode=755\n"
    "32 31 0:29 / /sys/fs/cgroup/cpu,cpuacct rw,relatime shared:5 - cgroup cgroup rw,cpu,cpuacct\n"
    "35 31 0:32 /docker/a /sys/fs/cgroup/memory rw,relatime - cgroup cgroup rw,memory\n"
    "41 31 0:38 / /sys/fs/cgroup/unified rw,relatime - cgroup2 cgroup2 rw\n";

constexpr std::string_view both_groups = "4:memory:/docker/a/b\n2:cpu,cpuacct:/c\n0::/d\n";

std::string file(std::vector<GroupFile> const& files, std::string_view name)
{
    for (auto const& each : files)
        if (each.name == name)
            return each.value;
    return {};
}

} // namespace

BOOST_AUTO_TEST_CASE(a_hierarchy_of_version_1_goes_before_that_of_version_2)
{
    auto const place = find_place(both_versions, both_groups, "cpu");
    BOOST_TEST(place.version == 1);
    BOOST_TEST(place.mount == "/sys/fs/cgroup/cpu,cpuacct");
    BOOST_TEST(place.folder == "/sys/fs/cgroup/cpu,cpuacct/c");
    BOOST_TEST(find_place(both_versions, both_groups, "pids").version == 2);
    BOOST_TEST(find_place(both_versions, both_groups, "pids").folder == "/sys/fs/cgroup/unified/d");
}

BOOST_AUTO_TEST_CASE(what_is_mounted_may_be_a_part_of_the_hierarchy)
{
    BOOST_TEST(find_place(both_versions, both_groups, "memory").folder == "/sys/fs/cgroup/memory/b");
    BOOST_TEST(find_place(both_versions, "4:memory:/docker/ab\n", "memory").version == 0);
    BOOST_TEST(find_place(both_versions, "0::/../elsewhere\n", "pids").version == 0);
}

BOOST_AUTO_TEST_CASE(where_nothing_is_mounted_there_is_no_place)
{
    BOOST_TEST(find_place("", both_groups, "memory").version == 0);
    BOOST_TEST(find_place("31 23 - cgroup2\nnonsense\n", both_groups, "memory").version == 0);
    BOOST_TEST(find_place(both_versions, "", "memory").version == 0);
}

BOOST_AUTO_TEST_CASE(the_name_of_a_group_tells_whose_it_is)
{
    BOOST_TEST(group_name(12, 3) == "webots_cloud-12-3");
    BOOST_TEST(server_of_group("webots_cloud-12-3") == 12);
    BOOST_TEST(server_of_group("webots_cloud-12") == 0);
    BOOST_TEST(server_of_group(server_group) == 0);
    BOOST_TEST(server_of_group("user.slice") == 0);
}

BOOST_AUTO_TEST_CASE(a_server_alone_in_its_group_moves_below_it)
{
    ParentGroup parent;
    parent.controllers = "cpuset cpu io memory pids\n";
    parent.processes = "77\n";
    auto const preparation = prepare_parent(parent, 77);
    BOOST_TEST(preparation.problem.empty());
    BOOST_TEST(preparation.move);
    BOOST_TEST(preparation.enable == "+memory +pids +cpu");
}

BOOST_AUTO_TEST_CASE(a_group_that_is_prepared_stays_as_it_is)
{
    ParentGroup parent;
    parent.controllers = "memory pids\n";
    parent.enabled = "pids memory\n";
    auto const preparation = prepare_parent(parent, 77);
    BOOST_TEST(preparation.problem.empty());
    BOOST_TEST(!preparation.move);
    BOOST_TEST(preparation.enable.empty());
}

BOOST_AUTO_TEST_CASE(a_group_with_programs_of_others_is_left_alone_unless_it_is_the_root)
{
    ParentGroup parent;
    parent.controllers = "memory pids";
    parent.enabled = "memory";
    parent.processes = "1\n77\n";
    BOOST_TEST(!prepare_parent(parent, 77).problem.empty());
    parent.is_root = true;
    auto const preparation = prepare_parent(parent, 77);
    BOOST_TEST(preparation.problem.empty());
    BOOST_TEST(!preparation.move);
    BOOST_TEST(preparation.enable == "+pids");
}

BOOST_AUTO_TEST_CASE(a_group_to_which_nothing_is_delegated_is_of_no_use)
{
    BOOST_TEST(!prepare_parent(ParentGroup(), 77).problem.empty());
}

BOOST_AUTO_TEST_CASE(each_version_has_its_own_files_for_the_same_limits)
{
    ProcessLimits limits;
    limits.memory = 1'000'000;
    limits.processors = 1.5;
    limits.processes = 50;
    auto const old_memory = limit_files(1, "memory", limits);
    BOOST_TEST(old_memory.front().name == "memory.limit_in_bytes"); // before that of memory and swap
    BOOST_TEST(file(old_memory, "memory.limit_in_bytes") == "1000000");
    BOOST_TEST(file(old_memory, "memory.memsw.limit_in_bytes") == "1000000");
    BOOST_TEST(file(limit_files(1, "cpu", limits), "cpu.cfs_quota_us") == "150000");
    BOOST_TEST(file(limit_files(1, "pids", limits), "pids.max") == "50");
    auto const memory = limit_files(2, "memory", limits);
    BOOST_TEST(file(memory, "memory.max") == "1000000");
    BOOST_TEST(file(memory, "memory.swap.max") == "0");
    BOOST_TEST(file(memory, "memory.oom.group") == "1");
    BOOST_TEST(file(limit_files(2, "cpu", limits), "cpu.max") == "150000 100000");
    BOOST_TEST(file(limit_files(2, "pids", limits), "pids.max") == "50");
}

BOOST_AUTO_TEST_CASE(no_limit_is_no_file)
{
    for (auto const controller : {"memory", "cpu", "pids", "cpuacct"})
        for (int const version : {1, 2})
            BOOST_TEST(limit_files(version, controller, ProcessLimits()).empty());
}

BOOST_AUTO_TEST_CASE(memory_is_counted_without_the_cache_of_files)
{
    BOOST_TEST(group_memory(1, "1000\n",
                            "total_inactive_file 300\ntotal_active_file 100\ninactive_file 7\n") == 600U);
    BOOST_TEST(group_memory(2, "1000\n", "anon 5\ninactive_file 300\nactive_file 100\n") == 600U);
    BOOST_TEST(group_memory(2, "100\n", "inactive_file 300\n") == 0U);
    BOOST_TEST(group_memory(2, "", "") == 0U);
}

BOOST_AUTO_TEST_CASE(time_of_processors_is_in_microseconds)
{
    BOOST_TEST(group_processor_time(1, "5000000\n") == 5000U);
    BOOST_TEST(group_processor_time(2, "usage_usec 5000\nuser_usec 1\n") == 5000U);
}

BOOST_AUTO_TEST_CASE(kills_and_refusals_are_read_from_events)
{
    BOOST_TEST(group_memory_kills("oom_kill_disable 0\nunder_oom 0\noom_kill 2\n") == 2U);
    BOOST_TEST(group_memory_kills("low 0\nhigh 0\nmax 9\noom 3\noom_kill 1\noom_group_kill 1\n") == 1U);
    BOOST_TEST(group_memory_kills("") == 0U);
    BOOST_TEST(group_refused_forks("max 4\n") == 4U);
}

BOOST_AUTO_TEST_SUITE_END()
