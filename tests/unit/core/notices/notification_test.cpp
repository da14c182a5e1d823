#include "unit_test.hpp"

#include "core/notices/notification.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 10.
BOOST_AUTO_TEST_SUITE(notification)

namespace {

constexpr auto noon = WallTime(std::chrono::sys_days(std::chrono::year(2026) / 2 / 28) + 12h + 3min + 4s);

LoadEvent event(LoadTransition transition, double load, std::string address = "a:2000")
{
    LoadEvent event;
    event.server = ServerLoad(std::move(address));
    event.server.report.load = load;
    event.transition = transition;
    return event;
}

core::News news(LoadTransition transition, double load = 0)
{
    return {event(transition, load), noon};
}

} // namespace

BOOST_AUTO_TEST_CASE(the_first_failed_poll_is_mailed_as_not_responding)
{
    auto const notice = core::news_notice(news(LoadTransition::not_responding), "https://h/1999/monitor");
    BOOST_TEST(notice.subject == "Simulation server not responding");
    BOOST_TEST(notice.text ==
               "Hello,\n"
               "\n"
               "a:2000 simulation server may be down, as it is not responding to the requests of the "
               "session server...\n"
               "Check it at https://h/1999/monitor\n"
               "\n"
               "-Simulation Server\n");
    BOOST_TEST((notice.written == noon));
}

BOOST_AUTO_TEST_CASE(the_first_good_poll_after_a_failure_is_mailed_as_working_again)
{
    auto const told = news(LoadTransition::working_again, 7.5);
    BOOST_TEST(told.subject == "Simulation server working again");
    BOOST_TEST(told.sentence == "a:2000 simulation server is up and running again (load = 7.5%).");
}

BOOST_AUTO_TEST_CASE(a_load_that_crosses_the_threshold_upwards_is_mailed_as_maximum)
{
    auto const told = news(LoadTransition::reached_maximum, 99);
    BOOST_TEST(told.subject == "Simulation server reached maximum load");
    BOOST_TEST(told.sentence == "a:2000 simulation server has reached maximum load (99.0%).");
}

BOOST_AUTO_TEST_CASE(a_load_that_crosses_the_threshold_downwards_is_mailed_as_available)
{
    auto const told = news(LoadTransition::available_again, 0.125);
    BOOST_TEST(told.subject == "Simulation server available again");
    BOOST_TEST(told.sentence == "a:2000 simulation server is available again (load = 0.125%).");
}

BOOST_AUTO_TEST_CASE(a_server_that_is_merely_slow_is_never_mailed)
{
    BOOST_TEST(!core::is_news(LoadTransition::too_slow));
    BOOST_TEST(!core::is_news(LoadTransition::none));
    for (auto const transition : {LoadTransition::not_responding, LoadTransition::working_again,
                                  LoadTransition::reached_maximum, LoadTransition::available_again})
        BOOST_TEST(core::is_news(transition));
}

BOOST_AUTO_TEST_CASE(the_link_says_https_iff_ssl_and_a_slash_iff_ports_are_rewritten)
{
    PublicAddress address;
    address.host = "h.org";
    address.port = 1999;
    BOOST_TEST(core::monitor_url(address) == "https://h.org/1999/monitor");
    address.port_rewrite = false;
    BOOST_TEST(core::monitor_url(address) == "https://h.org:1999/monitor");
    address.ssl = false;
    BOOST_TEST(core::monitor_url(address) == "http://h.org:1999/monitor");
    address.path = "/webots";
    BOOST_TEST(core::monitor_url(address) == "http://h.org/webots/monitor");
    address = PublicAddress();
    address.port = 80;
    address.ssl = false;
    BOOST_TEST(core::monitor_url(address) == "http://localhost/80/monitor");
    address.host = "*";
    BOOST_TEST(core::monitor_url(address) == "http://localhost/80/monitor");
}

BOOST_AUTO_TEST_CASE(an_address_can_add_no_line)
{
    core::News const told(event(LoadTransition::reached_maximum, 99, "a:2000\r\n\r\nforged"), noon);
    BOOST_TEST(told.sentence.find_first_of("\r\n") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_digest_lists_each_change_with_its_time)
{
    auto second = news(LoadTransition::working_again, 3);
    second.when += 61s;
    auto const notice =
        core::digest_notice({news(LoadTransition::not_responding), second}, 0, "http://h:1/monitor");
    BOOST_TEST(notice.subject == "Simulation servers: 2 changes");
    BOOST_TEST(notice.text ==
               "Hello,\n"
               "\n"
               "There were 2 changes of simulation servers:\n"
               "\n"
               "2026-02-28 12:03:04 UTC  a:2000 simulation server may be down, as it is not responding "
               "to the requests of the session server...\n"
               "2026-02-28 12:04:05 UTC  a:2000 simulation server is up and running again (load = 3.0%).\n"
               "\n"
               "Check it at http://h:1/monitor\n"
               "\n"
               "-Simulation Server\n");
    BOOST_TEST((notice.written == second.when));
}

BOOST_AUTO_TEST_CASE(a_digest_says_how_much_it_leaves_out)
{
    std::vector<core::News> const some(2, news(LoadTransition::not_responding));
    auto const notice = core::digest_notice(some, 40, "m");
    BOOST_TEST(notice.subject == "Simulation servers: 42 changes");
    BOOST_TEST(notice.text.find("\n\n(the first 40 are not listed)\n2026-") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_digest_of_one_change_is_the_mail_of_that_change)
{
    auto const one = news(LoadTransition::reached_maximum, 99);
    BOOST_TEST((core::digest_notice({one}, 0, "m") == core::news_notice(one, "m")));
}

BOOST_AUTO_TEST_CASE(summaries_are_one_line)
{
    auto const one = news(LoadTransition::reached_maximum, 99);
    BOOST_TEST(core::news_notice(one, "m").summary ==
               "2026-02-28 12:03:04 UTC a:2000 simulation server has reached maximum load (99.0%).");
    std::vector<core::News> const many(500, one);
    auto const summary = core::digest_notice(many, 0, "m").summary;
    BOOST_TEST(summary.find('\n') == std::string::npos);
    BOOST_TEST(summary.size() < 2100u);
}

BOOST_AUTO_TEST_SUITE_END()
