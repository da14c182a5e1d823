#include "unit_test.hpp"

#include "core/slurm/cluster_tables.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(cluster_tables)

namespace {

using Words = std::vector<std::string>;

constexpr auto printed_queue = "12|PENDING|Priority|1800|theirs|with|bars\n"
                               "14|PENDING|Resources|1000600|webots_cloud_h_2000_r_1_1\n"
                               "15|PENDING|QOSMaxJobsPerUserLimit|N/A|webots_cloud_h_2000_r_2_2\n"
                               "16|PENDING|Resources|31536000|webots_cloud_h_2000_r_3_3\n"
                               "10|RUNNING|None|1000|webots_cloud_h_2000_old_1_1\n"
                               "9|COMPLETING|None|900|webots_cloud_h_2000_old_2_2\n"
                               "8|RUNNING|None|900|webots_cloud_h_2001_r_1_1\n";

WallTime const now{1'000'000s};

} // namespace

BOOST_AUTO_TEST_CASE(jobs_are_read)
{
    auto const queue = parse_queue(printed_queue);
    BOOST_REQUIRE(queue.size() == 7u);
    BOOST_TEST(queue[0].name == "theirs|with|bars");
    BOOST_TEST(queue[1].id == "14");
    BOOST_TEST(queue[1].waits);
    BOOST_TEST((queue[1].start == now + 600s));
    BOOST_TEST(!queue[2].start.has_value());
    BOOST_TEST(!queue[4].waits);
    BOOST_TEST(queue[5].ends);
    BOOST_TEST(parse_queue("--me|RUNNING|None|0|x\n|RUNNING|None|0|x\n1 2|RUNNING|None|0|x\n").empty());
    BOOST_TEST(parse_queue("17_3|RUNNING|None|0|x\n").size() == 1u);
    BOOST_TEST(parse_queue("slurm_load_jobs error: Unable to contact slurm controller\n").empty());
}

BOOST_AUTO_TEST_CASE(who_waits_hears_a_position_and_slurms_estimate)
{
    auto const queue = parse_queue(printed_queue);
    BOOST_TEST(waiting_text(queue, "webots_cloud_h_2000_r_1_1", now) ==
               "Waiting for a free node of the cluster: position 2 of 4. Slurm expects the start in 10 min.");
    BOOST_TEST(waiting_text(queue, "webots_cloud_h_2000_r_2_2", now) ==
               "Waiting for a free node of the cluster: position 3 of 4. Slurm's reason: "
               "QOSMaxJobsPerUserLimit.");
    BOOST_TEST(waiting_text(queue, "webots_cloud_h_2000_old_1_1", now) == "");
    BOOST_TEST(waiting_text(queue, "nobody", now) == "");
}

BOOST_AUTO_TEST_CASE(an_estimate_of_a_year_or_of_the_past_is_none)
{
    auto const queue = parse_queue(printed_queue);
    BOOST_TEST(waiting_text(queue, "webots_cloud_h_2000_r_3_3", now) ==
               "Waiting for a free node of the cluster: position 4 of 4.");
    BOOST_TEST(waiting_text(queue, "webots_cloud_h_2000_r_1_1", now + 1h) ==
               "Waiting for a free node of the cluster: position 2 of 4.");
}

BOOST_AUTO_TEST_CASE(jobs_of_ours_that_nobody_knows_are_found_but_for_those_that_end)
{
    auto const queue = parse_queue(printed_queue);
    Words const known{"webots_cloud_h_2000_r_1_1", "webots_cloud_h_2000_r_2_2", "webots_cloud_h_2000_r_3_3"};
    BOOST_TEST(strangers(queue, "webots_cloud_h_2000_", known) == Words{"10"},
               boost::test_tools::per_element());
    BOOST_TEST(strangers(queue, "webots_cloud_x_2000_", {}).empty());
}

BOOST_AUTO_TEST_CASE(partitions_are_read)
{
    auto const partitions = parse_partitions("cpu*\ngpu\n");
    BOOST_TEST(partitions.names == (Words{"cpu", "gpu"}), boost::test_tools::per_element());
    BOOST_TEST(partitions.standard == "cpu");
    BOOST_TEST(parse_partitions("gpu\n").standard == "");
}

BOOST_AUTO_TEST_CASE(each_node_counts_once_and_those_that_take_no_job_not_at_all)
{
    auto const nodes = parse_nodes("n1   10.0.0.1   3/1/0/4   1000   750  \n"
                                   "n1   10.0.0.1   3/1/0/4   1000   750  \n"
                                   "n2   n2.cluster 0/4/0/4   2000   0    \n"
                                   "n3   10.0.0.3   0/0/8/8   9000   9000 \n"
                                   "not a node\n");
    BOOST_REQUIRE(nodes.size() == 3u);
    BOOST_TEST(nodes[0].address == "10.0.0.1");
    BOOST_TEST(nodes[1].name == "n2");
    BOOST_TEST(nodes[1].address == "n2.cluster");
    auto const load = load_of_nodes(nodes);
    BOOST_TEST(load.allocated == 3u);
    BOOST_TEST(load.processors == 8u);
    BOOST_TEST(load.memory == 3000u);
    BOOST_TEST(load.memory_used == 25);
    BOOST_TEST(load_of_nodes({}).memory_used == 0);
}

BOOST_AUTO_TEST_SUITE_END()
