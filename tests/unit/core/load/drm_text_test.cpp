#include "unit_test.hpp"

#include "core/load/drm_text.hpp"

using namespace webots_cloud::core;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(drm_text)

BOOST_AUTO_TEST_CASE(the_engine_that_was_busy_longest_counts)
{
    auto const client =
        parse_drm_client("pos:\t0\nflags:\t02100002\nmnt_id:\t24\nino:\t1044\n"
                         "drm-driver:\ti915\ndrm-pdev:\t0000:00:02.0\ndrm-client-id:\t7\n"
                         "drm-engine-render:\t9288864723 ns\ndrm-engine-copy:\t2035071108 ns\n"
                         "drm-engine-video:\t0 ns\ndrm-engine-capacity-video:\t2\n");
    BOOST_TEST_REQUIRE(client.has_value());
    BOOST_TEST(client->device == "0000:00:02.0");
    BOOST_TEST(client->id == 7u);
    BOOST_TEST((client->busy == 9288864723ns));
}

BOOST_AUTO_TEST_CASE(without_a_bus_the_driver_says_where_it_is)
{
    BOOST_TEST(parse_drm_client("drm-driver:\tmsm\ndrm-client-id:\t1\ndrm-engine-gpu:\t5 ns\n")->device ==
               "msm");
}

BOOST_AUTO_TEST_CASE(what_is_no_such_file_says_nothing)
{
    for (auto const* text :
         {"", "pos:\t0\nflags:\t02\n", "drm-client-id:\t7\n", "drm-engine-render:\t5 ns\n",
          "drm-client-id:\tx\ndrm-engine-render:\t5 ns\n", "drm-client-id:\t7\ndrm-engine-render:\t5 KiB\n",
          "drm-client-id:\t7\ndrm-engine-render:\t-5 ns\n",
          "drm-client-id:\t7\ndrm-engine-capacity-render:\t5 ns\n", "drm-client-id 7\ndrm-engine-render 5 ns",
          "drm-client-id:\t7\ndrm-engine-render:\t99999999999999999999 ns"})
        BOOST_TEST(!parse_drm_client(text).has_value(), text);
}

BOOST_AUTO_TEST_SUITE_END()
