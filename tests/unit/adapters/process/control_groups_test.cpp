#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/process/control_groups.hpp"

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

using namespace webots_cloud;
namespace fs = std::filesystem;

namespace {

/// A folder in which plain files stand for those of the kernel.
struct ControlGroupsAdapterFixture : ScratchFolder
{
    void write(fs::path const& file, std::string const& text) const
    {
        fs::create_directories((folder / file).parent_path());
        std::ofstream(folder / file) << text;
    }

    std::string read(fs::path const& file) const
    {
        std::ifstream stream(folder / file);
        return {std::istreambuf_iterator<char>(stream), {}};
    }

    /// Version 2, with this process in the group `unit`, where these are in, too.
    void make_version_2(std::string const& others = {}) const
    {
        write("mounts", "41 31 0:38 / " + (folder / "groups").string() + " rw - cgroup2 cgroup2 rw\n");
        write("own", "0::/unit\n");
        write("groups/unit/cgroup.type", "domain\n");
        write("groups/unit/cgroup.controllers", "cpu memory pids\n");
        write("groups/unit/cgroup.procs", std::to_string(::getpid()) + "\n" + others);
        write("groups/unit/cgroup.subtree_control", "");
    }

    void make_version_1() const
    {
        std::string mounts;
        std::string own;
        for (std::string const controller : {"memory", "pids", "cpu", "cpuacct"}) {
            mounts += "32 31 0:29 / " + (folder / controller).string() + " rw - cgroup cgroup rw," +
                      controller + "\n";
            own += "1:" + controller + ":/a\n";
            fs::create_directories(folder / controller / "a");
        }
        write("mounts", mounts);
        write("own", own);
    }

    ControlGroups groups(bool may_use_root = false) const
    {
        ControlGroupsParams params;
        params.mounts = folder / "mounts";
        params.own_group = folder / "own";
        params.may_use_root = may_use_root;
        return ControlGroups(params);
    }

    static ProcessLimits limits()
    {
        ProcessLimits limits;
        limits.memory = 1'000'000;
        limits.processors = 2;
        limits.processes = 50;
        return limits;
    }

    std::string name = "webots_cloud-" + std::to_string(::getpid()) + "-1";
};

} // namespace

BOOST_FIXTURE_TEST_SUITE(control_groups_adapter, ControlGroupsAdapterFixture)

BOOST_AUTO_TEST_CASE(with_version_1_each_controller_gets_a_group_with_its_limit)
{
    make_version_1();
    auto groups = this->groups();
    BOOST_TEST(groups.support().memory);
    BOOST_TEST(groups.support().processes);
    BOOST_TEST(groups.support().processors);
    BOOST_TEST(groups.support().version == 1);
    BOOST_TEST(groups.mounts().size() == 4U);
    auto const group = groups.make(limits());
    BOOST_TEST_REQUIRE(group.has_value());
    BOOST_TEST(group->folders.size() == 4U);
    BOOST_TEST(read("memory/a/" + name + "/memory.limit_in_bytes") == "1000000");
    BOOST_TEST(read("pids/a/" + name + "/pids.max") == "50");
    BOOST_TEST(read("cpu/a/" + name + "/cpu.cfs_quota_us") == "200000");
}

BOOST_AUTO_TEST_CASE(with_version_2_the_server_moves_below_and_one_group_has_all_limits)
{
    make_version_2();
    auto const before = groups();
    BOOST_TEST(read("groups/unit/webots_cloud-server/cgroup.procs") == std::to_string(::getpid()));
    BOOST_TEST(read("groups/unit/cgroup.subtree_control") == "+memory +pids +cpu");
    BOOST_TEST(!before.support().memory); // nobody has done that here: a kernel that does not is noticed
    write("groups/unit/cgroup.subtree_control", "cpu memory pids");
    auto groups = this->groups();
    BOOST_TEST(groups.support().version == 2);
    auto const group = groups.make(limits());
    BOOST_TEST_REQUIRE(group.has_value());
    BOOST_TEST(group->folders.size() == 1U);
    BOOST_TEST(read("groups/unit/" + name + "/memory.max") == "1000000");
    BOOST_TEST(read("groups/unit/" + name + "/pids.max") == "50");
    BOOST_TEST(read("groups/unit/" + name + "/cpu.max") == "200000 100000");
}

BOOST_AUTO_TEST_CASE(a_server_that_has_moved_already_makes_groups_beside_its_own)
{
    make_version_2();
    write("own", "0::/unit/webots_cloud-server\n");
    write("groups/unit/cgroup.procs", "");
    write("groups/unit/cgroup.subtree_control", "cpu memory pids");
    auto groups = this->groups();
    BOOST_TEST(groups.support().memory);
    BOOST_TEST_REQUIRE(groups.make(limits()).has_value());
    BOOST_TEST(fs::exists(folder / "groups/unit" / name));
}

BOOST_AUTO_TEST_CASE(with_others_in_its_group_none_is_made_and_the_reason_is_told)
{
    make_version_2("1\n");
    auto const groups = this->groups();
    BOOST_TEST(!groups.support().memory);
    BOOST_TEST(!groups.support().processes);
    BOOST_TEST(groups.support().problem.find("other programs are in it") != std::string::npos);
    BOOST_TEST(!fs::exists(folder / "groups/unit/webots_cloud-server"));
}

BOOST_AUTO_TEST_CASE(then_root_makes_them_beside_all_others)
{
    make_version_2("1\n");
    write("groups/cgroup.controllers", "cpu memory pids");
    write("groups/cgroup.subtree_control", "cpu memory pids");
    auto groups = this->groups(true);
    BOOST_TEST(groups.support().memory);
    BOOST_TEST_REQUIRE(groups.make(limits()).has_value());
    BOOST_TEST(fs::exists(folder / "groups" / name));
}

BOOST_AUTO_TEST_CASE(without_control_groups_there_is_a_reason_and_groups_without_folders)
{
    auto groups = this->groups();
    BOOST_TEST(!groups.support().memory);
    BOOST_TEST(!groups.support().problem.empty());
    auto const group = groups.make(limits());
    BOOST_TEST_REQUIRE(group.has_value());
    BOOST_TEST(group->folders.empty());
    BOOST_TEST((ControlGroups::usage(*group) == ProcessUsage()));
}

BOOST_AUTO_TEST_CASE(a_limit_that_can_not_be_set_is_a_failure_and_leaves_nothing)
{
    make_version_1();
    auto groups = this->groups();
    fs::remove_all(folder / "pids");
    auto const group = groups.make(limits());
    BOOST_TEST_REQUIRE(!group.has_value());
    BOOST_TEST(group.error().message().find("its limits can't be set") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(usage_comes_from_the_files_of_the_group)
{
    make_version_2();
    write("groups/unit/cgroup.subtree_control", "cpu memory pids");
    auto groups = this->groups();
    auto const group = groups.make(limits());
    BOOST_TEST_REQUIRE(group.has_value());
    fs::path const own = fs::path("groups/unit") / name;
    write(own / "memory.current", "5000\n");
    write(own / "memory.stat", "inactive_file 1000\n");
    write(own / "memory.events", "oom_kill 2\n");
    write(own / "pids.current", "7\n");
    write(own / "pids.events", "max 3\n");
    write(own / "cpu.stat", "usage_usec 1500000\n");
    auto const usage = ControlGroups::usage(*group);
    BOOST_TEST(usage.memory_bytes == 4000U);
    BOOST_TEST(usage.memory_kills == 2U);
    BOOST_TEST(usage.processes == 7U);
    BOOST_TEST(usage.refused_forks == 3U);
    BOOST_TEST((usage.processor == std::chrono::milliseconds(1500)));
}

BOOST_AUTO_TEST_CASE(empty_groups_of_servers_that_are_gone_are_removed_once_they_are_old)
{
    make_version_1();
    int const gone = ::fork();
    if (gone == 0)
        ::_exit(0);
    while (::kill(gone, 0) == 0)
        (void)::waitpid(gone, nullptr, 0);
    auto const make = [&](std::string const& group) {
        fs::create_directory(folder / "pids/a" / group);
        return folder / "pids/a" / group;
    };
    auto const old = make("webots_cloud-" + std::to_string(gone) + "-4");
    auto const young = make("webots_cloud-" + std::to_string(gone) + "-5");
    auto const living = make("webots_cloud-" + std::to_string(::getppid()) + "-4");
    auto const of_others = make("of_others");
    auto const long_ago = fs::file_time_type::clock::now() - std::chrono::minutes(1);
    for (auto const& group : {old, living, of_others})
        fs::last_write_time(group, long_ago);
    auto groups = this->groups();
    BOOST_TEST(!fs::exists(old));
    BOOST_TEST(
        fs::exists(young)); // perhaps of a server in another PID namespace, whose simulation is about to join
    BOOST_TEST(fs::exists(living));
    BOOST_TEST(fs::exists(of_others));
    fs::last_write_time(young, long_ago);
    BOOST_TEST_REQUIRE(groups.make(limits()).has_value());
    BOOST_TEST(!fs::exists(young));
    BOOST_TEST(fs::exists(folder / "pids/a" / name));
}

BOOST_AUTO_TEST_SUITE_END()
