#include "unit_test.hpp"

#include "core/doctor/machine_findings.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(machine_findings)

namespace {

constexpr std::uint64_t gigabyte = std::uint64_t{1} << 30;

FolderReading good_folder()
{
    FolderReading reading;
    reading.path = "/srv/cache";
    reading.free = 5 * gigabyte;
    reading.total = 10 * gigabyte;
    reading.free_files = 100'000;
    reading.total_files = 200'000;
    return reading;
}

Finding judge(FolderReading const& reading)
{
    return judge_folder("cache", "XDG_CACHE_HOME", reading, 2 * gigabyte);
}

} // namespace

BOOST_AUTO_TEST_CASE(a_folder_with_room_is_good)
{
    auto reading = good_folder();
    BOOST_TEST((judge(reading) == Finding(Verdict::ok, "cache", "/srv/cache: 5.0GB of 10.0GB free")));
    reading.exists = false;
    BOOST_TEST(judge(reading).found == "/srv/cache (made at the start): 5.0GB of 10.0GB free");
    BOOST_TEST((judge(reading).verdict == Verdict::ok));
}

BOOST_AUTO_TEST_CASE(a_folder_that_can_not_be_written_is_a_fault)
{
    auto reading = good_folder();
    reading.problem = "Permission denied";
    BOOST_TEST((judge(reading).verdict == Verdict::fault));
    BOOST_TEST(judge(reading).found == "nothing can be written to /srv/cache: Permission denied");
    BOOST_TEST(judge(reading).remedy.find("XDG_CACHE_HOME") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_full_disk_is_a_fault_and_one_that_will_be_a_warning)
{
    auto reading = good_folder();
    reading.free = 1 << 20;
    BOOST_TEST((judge(reading).verdict == Verdict::fault));
    BOOST_TEST(judge(reading).found.find("the disk is full") != std::string::npos);
    reading.free = gigabyte;
    BOOST_TEST((judge(reading).verdict == Verdict::warning));
    BOOST_TEST(judge(reading).found.find("may want 2.0GB") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(inodes_run_out_too_where_they_are_counted)
{
    auto reading = good_folder();
    reading.free_files = 10;
    BOOST_TEST((judge(reading).verdict == Verdict::fault));
    BOOST_TEST(judge(reading).found.find("only 10 more files (inodes)") != std::string::npos);
    reading.free_files = reading.total_files = 0; // btrfs
    BOOST_TEST((judge(reading).verdict == Verdict::ok));
}

BOOST_AUTO_TEST_CASE(little_memory_is_a_warning)
{
    BOOST_TEST((judge_memory(4 * gigabyte, 8 * gigabyte, gigabyte) ==
                Finding(Verdict::ok, "memory", "4.0GB of 8.0GB are available")));
    auto const little = judge_memory(gigabyte, 8 * gigabyte, 2 * gigabyte);
    BOOST_TEST((little.verdict == Verdict::warning));
    BOOST_TEST(little.found == "1.0GB of 8.0GB are available, and the server may want 2.0GB");
}

BOOST_AUTO_TEST_CASE(a_clock_that_nobody_keeps_right_is_a_warning)
{
    BOOST_TEST((judge_clock(true).verdict == Verdict::ok));
    BOOST_TEST((judge_clock(false).verdict == Verdict::warning));
    BOOST_TEST(judge_clock(false).remedy.starts_with("Install systemd-timesyncd or chrony"));
}

BOOST_AUTO_TEST_CASE(a_low_limit_of_open_files_is_a_warning)
{
    BOOST_TEST((judge_open_files(4096, 4096).verdict == Verdict::ok));
    auto const low = judge_open_files(1024, 4096);
    BOOST_TEST((low.verdict == Verdict::warning));
    BOOST_TEST(low.found == "at most 1024 at a time, and this configuration may want 4096");
}

BOOST_AUTO_TEST_SUITE_END()
