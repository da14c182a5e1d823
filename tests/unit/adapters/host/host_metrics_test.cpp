#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/host/drm_clients.hpp"
#include "core/load/load_formula.hpp"

#include <webots_cloud/adapters.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

using namespace webots_cloud;
namespace fs = std::filesystem;

namespace {

/// Control groups in a folder; that of the test is /a/b.
struct HostMetricsFixture : ScratchFolder
{
    HostMetricsFixture()
    {
        fs::create_directories(folder / "groups/a/b");
        write("own", "1:name=systemd:/other\n0::/a/b\n");
        params.control_groups = folder / "groups";
        params.own_control_group = folder / "own";
        params.nvidia_library = (folder / "none.so").string();
    }
    void write(std::string const& path, std::string const& text) const
    {
        std::ofstream(folder / path) << text;
    }

    HostSample sample() const { return make_host_metrics(params)->sample(); }

    HostMetricsParams params;
};

} // namespace

// Protocol section 4.2; limits of control groups are ours.
BOOST_FIXTURE_TEST_SUITE(host_metrics, HostMetricsFixture)

BOOST_AUTO_TEST_CASE(without_limits_the_machine_is_what_counts)
{
    write("groups/a/b/memory.max", "max\n");
    write("groups/a/b/cpu.max", "max 100000\n");
    auto const looked = sample();
    BOOST_TEST(looked.share_total == 0u);
    BOOST_TEST(looked.cpu_total > 0u);
    BOOST_TEST(looked.memory_used > 0);
    BOOST_TEST(!looked.gpu.has_value());
}

BOOST_AUTO_TEST_CASE(the_memory_of_a_group_counts_without_what_the_kernel_would_give_back)
{
    write("groups/a/memory.max", "1000000\n"); // in the parent group
    write("groups/a/memory.current", "1000000\n");
    write("groups/a/memory.stat", "anon 5\ninactive_file 7000\nactive_file 3000\n");
    BOOST_TEST(sample().memory_used == 99);
    write("groups/a/memory.current", "9000000\n"); // above the limit, as while that is being lowered
    BOOST_TEST(sample().memory_used == 100);
}

BOOST_AUTO_TEST_CASE(the_files_of_a_build_that_has_ended_do_not_fill_a_group)
{
    write("groups/a/memory.max", "4000000000\n");
    write("groups/a/memory.current", "3990000000\n");
    write("groups/a/memory.stat",
          "anon 40000000\nfile 3950000000\ninactive_file 2000000000\nactive_file 1950000000\n");
    BOOST_TEST(sample().memory_used < 99); // the page cache does not count
}

BOOST_AUTO_TEST_CASE(a_limit_above_the_machine_is_none)
{
    write("groups/a/b/memory.max", "9000000000000000000\n");
    write("groups/a/b/memory.current", "8999999999999999999\n");
    write("groups/a/b/cpu.max", "99999999999 100000\n");
    write("groups/a/b/cpu.stat", "usage_usec 100\n");
    BOOST_TEST(sample().memory_used < 100);
    BOOST_TEST(sample().share_total == 0u);
}

BOOST_AUTO_TEST_CASE(a_share_of_the_processors_is_full_before_they_are)
{
    write("groups/a/cpu.max", "50000 100000\n");
    write("groups/a/cpu.stat", "usage_usec 5000000\nuser_usec 1\n");
    write("groups/a/b/cpu.max", "60000 100000\n"); // more than the parent group allows
    write("groups/a/b/cpu.stat", "usage_usec 7\n");
    auto const before = sample();
    BOOST_TEST(before.share_busy == 5'000'000u);
    auto after = before;
    after.share_busy += 400'000;
    after.share_total += 500'000; // one second of half a processor
    BOOST_TEST(core::cpu_percent(before, after) == 80);
}

BOOST_AUTO_TEST_CASE(groups_of_version_1_limit_in_the_same_way)
{
    write("own", "4:memory:/a\n3:cpu,cpuacct:/a\n0::/\n");
    fs::create_directories(folder / "groups/memory/a");
    fs::create_directories(folder / "groups/cpu/a");
    write("groups/memory/memory.limit_in_bytes", "9223372036854771712\n");
    write("groups/memory/a/memory.limit_in_bytes", "1000000\n");
    write("groups/memory/a/memory.usage_in_bytes", "1000000\n");
    write("groups/memory/a/memory.stat",
          "cache 5\ninactive_file 0\ntotal_inactive_file 7000\ntotal_active_file 3000\n");
    write("groups/cpu/cpu.cfs_quota_us", "-1\n");
    write("groups/cpu/cpu.cfs_period_us", "100000\n");
    write("groups/cpu/a/cpu.cfs_quota_us", "50000\n");
    write("groups/cpu/a/cpu.cfs_period_us", "100000\n");
    auto const uncounted = sample();
    BOOST_TEST(uncounted.memory_used == 99);
    BOOST_TEST(uncounted.share_total == 0u); // the usage is not reported
    write("groups/cpu/a/cpuacct.usage", "5000000000\n");
    auto const looked = sample();
    BOOST_TEST(looked.share_busy == 5'000'000u);
    BOOST_TEST(looked.share_total > 0u);
}

// Section 9.2: as the library of the Python servers computes it, which is as df does but for the rounding.
BOOST_AUTO_TEST_CASE(the_disk_is_as_full_as_df_says)
{
    auto const metrics = make_host_metrics(params);
    auto* const df = ::popen("LC_ALL=C df --output=pcent /", "r");
    BOOST_TEST_REQUIRE(df != nullptr);
    int percent = -1;
    bool const is_told = std::fscanf(df, " Use%% %d", &percent) == 1;
    ::pclose(df);
    if (!is_told) {
        BOOST_TEST_MESSAGE("skipped: df knows nothing of the root here");
        return;
    }
    BOOST_TEST(std::abs(metrics->sample().disk_used - percent) <= 1.5);
}

BOOST_AUTO_TEST_CASE(of_several_graphics_processors_the_highest_figures_count)
{
    params.nvidia_library = FAKE_NVML;
    auto const metrics = make_host_metrics(params);
    auto const gpu = metrics->sample().gpu;
    BOOST_TEST_REQUIRE(gpu.has_value());
    BOOST_TEST(gpu->compute == 35);
    BOOST_TEST(gpu->memory_controller == 20);
    BOOST_TEST(gpu->memory_used == 75);
    BOOST_TEST(metrics->description().gpu == "2x NVIDIA Fake (16.0GB)");
}

BOOST_AUTO_TEST_CASE(nvidias_library_tells_how_long_a_process_has_used_a_graphics_processor)
{
    params.nvidia_library = FAKE_NVML;
    auto const metrics = make_host_metrics(params);
    BOOST_TEST(metrics->description().graphics_processors == 2);
    auto const times = metrics->graphics_times();
    BOOST_TEST_REQUIRE(times != nullptr);
    int const processes[] = {17, 18, 19};
    auto const busy = times->busy(processes); // since the library was loaded
    BOOST_TEST((busy > Duration::zero()));
    int const idle[] = {18, 19};
    BOOST_TEST((times->busy(idle) == Duration::zero()));
}

// What the kernel says of open files is read in a copy of its folder.
BOOST_AUTO_TEST_CASE(what_processes_share_of_a_graphics_processor_counts_once)
{
    auto const open = [this](int process, int file, std::string const& target, std::string const& told) {
        auto const of_process = folder / "proc" / std::to_string(process);
        fs::create_directories(of_process / "fd");
        fs::create_directories(of_process / "fdinfo");
        fs::create_symlink(target, of_process / "fd" / std::to_string(file));
        std::ofstream(of_process / "fdinfo" / std::to_string(file)) << "pos:\t0\n" << told;
    };
    auto const client = [](int id, int nanoseconds) {
        return "drm-pdev:\t0000:01:00.0\ndrm-client-id:\t" + std::to_string(id) + "\ndrm-engine-gfx:\t" +
               std::to_string(nanoseconds) + " ns\n";
    };
    open(1, 3, "/dev/dri/renderD128", client(7, 1000));
    open(1, 4, "/dev/dri/renderD128", client(7, 1000)); // a duplicate
    open(1, 5, "/tmp/renderD128", client(9, 5000));     // no graphics processor
    open(2, 3, "/dev/dri/renderD128", client(7, 1000)); // a child has it, too
    open(2, 4, "/dev/dri/renderD128", client(8, 300));
    open(2, 5, "/dev/dri/card0", "");
    int const processes[] = {1, 2, 3};
    BOOST_TEST((adapters::drm_time(folder / "proc", processes) == std::chrono::nanoseconds(1300)));
    fs::create_directories(folder / "dri/by-path");
    for (auto const* name : {"card0", "renderD128", "renderD129"})
        write("dri/" + std::string(name), "");
    BOOST_TEST(adapters::count_drm_devices(folder / "dri") == 2);
    BOOST_TEST(adapters::count_drm_devices(folder / "none") == 0);
}

BOOST_AUTO_TEST_CASE(a_library_that_is_something_else_is_none)
{
    params.nvidia_library = "libc.so.6";
    auto const metrics = make_host_metrics(params);
    BOOST_TEST(!metrics->sample().gpu.has_value());
    BOOST_TEST(metrics->description().gpu.empty());
}

BOOST_AUTO_TEST_SUITE_END()
