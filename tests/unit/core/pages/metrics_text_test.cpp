#include "unit_test.hpp"

#include "core/pages/metrics_text.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(metrics_text)

BOOST_AUTO_TEST_CASE(families_and_values_are_written_as_prometheus_reads_them)
{
    MetricsText metrics;
    metrics.family(metric("servers")).add(3, {{"state", "up"}}).add(0.5, {{"state", "x"}, {"b", "c"}});
    metrics.family(metric("polls_total")).add(12345678);
    BOOST_TEST(metrics.take() == "# HELP webots_servers Simulation servers by what their last poll said.\n"
                                 "# TYPE webots_servers gauge\n"
                                 "webots_servers{state=\"up\"} 3\n"
                                 "webots_servers{state=\"x\",b=\"c\"} 0.5\n"
                                 "# HELP webots_polls_total Polls of simulation servers.\n"
                                 "# TYPE webots_polls_total counter\n"
                                 "webots_polls_total 12345678\n");
}

BOOST_AUTO_TEST_CASE(labels_are_escaped)
{
    MetricsText metrics;
    metrics.family(metric("machine_up")).add(1, {{"machine", "a\"b\\c\nd"}});
    BOOST_TEST(metrics.take().ends_with("webots_machine_up{machine=\"a\\\"b\\\\c\\nd\"} 1\n"));
}

BOOST_AUTO_TEST_CASE(buckets_of_a_histogram_count_all_values_up_to_their_bound)
{
    Histogram took{0.5, 2};
    for (double const value : {0.5, 1.0, 1.5, 7.0})
        took.add(value);
    MetricsText metrics;
    metrics.family(metric("waiting_seconds")).add(took, {{"stage", "a"}}).add(Histogram{1});
    auto const text = metrics.take();
    BOOST_TEST(text.substr(text.find("histogram\n") + 10) ==
               "webots_waiting_seconds_bucket{stage=\"a\",le=\"0.5\"} 1\n"
               "webots_waiting_seconds_bucket{stage=\"a\",le=\"2\"} 3\n"
               "webots_waiting_seconds_bucket{stage=\"a\",le=\"+Inf\"} 4\n"
               "webots_waiting_seconds_sum{stage=\"a\"} 10\n"
               "webots_waiting_seconds_count{stage=\"a\"} 4\n"
               "webots_waiting_seconds_bucket{le=\"1\"} 0\n"
               "webots_waiting_seconds_bucket{le=\"+Inf\"} 0\n"
               "webots_waiting_seconds_sum 0\n"
               "webots_waiting_seconds_count 0\n");
}

BOOST_AUTO_TEST_CASE(whole_numbers_have_no_exponent)
{
    MetricsText metrics;
    metrics.family(metric("waiting")).add(3e6).add(17179869184.0).add(-1).add(0).add(1e300).add(0.25);
    auto const text = metrics.take();
    BOOST_TEST(text.substr(text.find("gauge\n") + 6) == "webots_waiting 3000000\n"
                                                        "webots_waiting 17179869184\n"
                                                        "webots_waiting -1\n"
                                                        "webots_waiting 0\n"
                                                        "webots_waiting 1e+300\n"
                                                        "webots_waiting 0.25\n");
}

BOOST_AUTO_TEST_SUITE_END()
