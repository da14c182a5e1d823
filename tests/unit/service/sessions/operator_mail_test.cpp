#include "unit_test.hpp"

#include "async/task_group.hpp"

#include <webots_cloud/operator_mail.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/recording_notifier.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>
#include <set>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

// Protocol section 10.
BOOST_AUTO_TEST_SUITE(operator_mail)

namespace {

asio::awaitable<void> run(OperatorMail& mail, result<>& outcome)
{
    outcome = co_await mail.run();
}

PublicAddress server()
{
    PublicAddress address;
    address.host = "h.org";
    address.port = 1999;
    return address;
}

struct Fixture
{
    Fixture()
        : notifier(world.clock), mail("admin@b.org", server(), notifier, world.clock, log.logger()),
          tasks(world.executor())
    {}

    ~Fixture()
    {
        stop();
        BOOST_TEST(world.clock.pending() == 0u);
    }

    void start()
    {
        tasks.spawn(run(mail, outcome));
        world.settle();
    }

    void stop() { world.run(tasks.end()); }

    void note(LoadTransition transition, std::string address = "a:2000", double load = 99)
    {
        LoadEvent event;
        event.server = ServerLoad(std::move(address));
        event.server.report.load = load;
        event.transition = transition;
        mail.note(event);
        world.settle();
    }

    /// Down and up, a change every 5 s.
    void flap(Duration duration)
    {
        for (auto left = duration; left > Duration::zero(); left -= 10s) {
            note(LoadTransition::not_responding);
            world.advance(5s);
            note(LoadTransition::working_again);
            world.advance(5s);
        }
    }

    std::vector<std::string> subjects() const
    {
        std::vector<std::string> subjects;
        for (auto const& notice : notifier.delivered)
            subjects.push_back(notice.subject);
        return subjects;
    }

    std::size_t errors() const
    {
        return static_cast<std::size_t>(
            std::count_if(log.lines.begin(), log.lines.end(), [](std::string const& line) {
                return line.starts_with("Error: unable to send email to admin@b.org");
            }));
    }

    testing::World world;
    testing::RecordingLog log;
    testing::RecordingNotifier notifier;
    OperatorMail mail;
    async::TaskGroup tasks;
    result<> outcome;
};

using Subjects = std::vector<std::string>;

} // namespace

BOOST_AUTO_TEST_CASE(each_kind_of_change_is_one_mail_at_once)
{
    Fixture fixture;
    fixture.start();
    fixture.note(LoadTransition::not_responding, "a:1");
    fixture.note(LoadTransition::working_again, "b:2", 1.5);
    fixture.note(LoadTransition::reached_maximum, "c:3", 97);
    fixture.note(LoadTransition::available_again, "d:4", 3);
    fixture.note(LoadTransition::too_slow, "e:5");
    fixture.note(LoadTransition::none, "f:6");
    BOOST_TEST(fixture.subjects() ==
                   (Subjects{"Simulation server not responding", "Simulation server working again",
                             "Simulation server reached maximum load", "Simulation server available again"}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.notifier.delivered[1].text ==
               "Hello,\n\nb:2 simulation server is up and running again (load = "
               "1.5%).\nCheck it at https://h.org/1999/monitor\n\n"
               "-Simulation Server\n");
    BOOST_TEST((fixture.notifier.delivered[0].written == fixture.world.clock.wall()));
    BOOST_TEST(fixture.log.lines.empty());
}

BOOST_AUTO_TEST_CASE(what_was_noted_before_it_ran_is_mailed_then)
{
    Fixture fixture;
    fixture.note(LoadTransition::not_responding);
    BOOST_TEST(fixture.notifier.attempts.empty());
    fixture.start();
    BOOST_TEST(fixture.notifier.delivered.size() == 1u);
}

BOOST_AUTO_TEST_CASE(a_flapping_server_is_two_mails_and_then_a_digest_every_ten_minutes)
{
    Fixture fixture;
    fixture.start();
    fixture.flap(30min);
    auto const& delivered = fixture.notifier.delivered;
    BOOST_TEST(fixture.subjects() ==
                   (Subjects{"Simulation server not responding", "Simulation server working again",
                             "Simulation servers: 120 changes", "Simulation servers: 120 changes"}),
               boost::test_tools::per_element());
    BOOST_TEST(delivered[2].text.find("2026-01-01 01:00:10 UTC  a:2000 simulation server may be down") !=
               std::string::npos);
    BOOST_TEST(
        delivered[2].text.find("01:10:05 UTC  a:2000 simulation server is up and running again (load = "
                               "99.0%).\n\nCheck it at") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_mail_server_that_is_down_costs_one_line_and_is_tried_less_and_less_often)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::unreachable, "no route");
    fixture.start();
    auto const began = fixture.world.clock.now();
    fixture.note(LoadTransition::not_responding);
    fixture.world.advance(1h);
    std::vector<long> seconds;
    for (auto const attempt : fixture.notifier.attempts)
        seconds.push_back(std::chrono::duration_cast<std::chrono::seconds>(attempt - began).count());
    BOOST_TEST(seconds == (std::vector<long>{0, 15, 45, 105, 225, 465, 945, 1845, 2745}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.log.lines ==
                   (std::vector<std::string>{"Error: unable to send email to admin@b.org: no route"}),
               boost::test_tools::per_element());

    fixture.notifier.failure.reset();
    fixture.world.advance(15min);
    BOOST_TEST(fixture.notifier.delivered.size() == 1u);
    BOOST_TEST(fixture.log.lines.back() == "Emails to admin@b.org are sent again");
    BOOST_TEST((fixture.world.clock.wall() - fixture.notifier.delivered[0].written > 1h));
}

BOOST_AUTO_TEST_CASE(a_failure_of_another_kind_is_logged_too)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::unreachable, "no connection after 3 ms");
    fixture.start();
    fixture.note(LoadTransition::not_responding);
    fixture.notifier.failure = Failure(errc::unreachable, "no connection after 7 ms");
    fixture.world.advance(15s);
    BOOST_TEST(fixture.errors() == 1u);
    fixture.notifier.failure = Failure(errc::timed_out, "says nothing");
    fixture.world.advance(30s);
    BOOST_TEST(fixture.errors() == 2u);
    BOOST_TEST(fixture.log.lines.back() == "Error: unable to send email to admin@b.org: says nothing");
}

BOOST_AUTO_TEST_CASE(whichever_attempt_fails_every_mail_arrives_once_and_in_order)
{
    for (int call = 1;; ++call) {
        Fixture fixture;
        fixture.notifier.fuse = testing::Fuse(call);
        fixture.start();
        for (auto const* address : {"a:1", "b:2", "c:3"})
            fixture.note(LoadTransition::not_responding, address);
        fixture.world.advance(1min);
        BOOST_TEST_REQUIRE(fixture.notifier.delivered.size() == 3u, call);
        std::set<std::string> ids;
        for (std::size_t i = 0; i < 3; ++i) {
            BOOST_TEST(fixture.notifier.delivered[i].text.find(std::string(1, "abc"[i]) + ":") !=
                           std::string::npos,
                       call);
            ids.insert(fixture.notifier.delivered[i].id);
        }
        BOOST_TEST(ids.size() == 3u);
        BOOST_TEST(fixture.errors() == (fixture.notifier.fuse.blown() ? 1u : 0u));
        if (!fixture.notifier.fuse.blown())
            break;
    }
}

BOOST_AUTO_TEST_CASE(a_slow_mail_server_delays_mails_and_nobody_else)
{
    Fixture fixture;
    fixture.notifier.delay = 20s;
    fixture.start();
    auto const began = fixture.world.clock.now();
    fixture.note(LoadTransition::not_responding, "a:1");
    fixture.note(LoadTransition::not_responding, "b:2");
    BOOST_TEST((fixture.world.clock.now() == began));
    fixture.world.advance(20s);
    BOOST_TEST(fixture.notifier.delivered.size() == 1u);
    fixture.world.advance(20s);
    BOOST_TEST(fixture.notifier.delivered.size() == 2u);
}

BOOST_AUTO_TEST_CASE(what_is_refused_again_and_again_goes_to_the_log)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::refused, "550 no such user");
    fixture.start();
    fixture.note(LoadTransition::not_responding);
    fixture.world.advance(20min);
    BOOST_TEST(fixture.notifier.attempts.size() == 6u);
    BOOST_TEST(fixture.errors() == 1u);
    BOOST_TEST(fixture.log.lines.back() ==
               "Email to admin@b.org not sent (it was refused again and again): 2026-01-01 01:00:00 UTC "
               "a:2000 simulation "
               "server may be down, as it is not responding to the requests of the session server...");
}

BOOST_AUTO_TEST_CASE(the_queue_is_bounded_and_what_it_drops_goes_to_the_log)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::unreachable);
    fixture.start();
    for (int i = 0; i < 60; ++i) {
        fixture.note(LoadTransition::not_responding, std::to_string(i) + ":1");
        fixture.world.advance(20min);
    }
    BOOST_TEST(fixture.log.contains(
        "Email to admin@b.org not sent (too many are waiting): 2026-01-01 01:00:00 UTC 0:1 "));
    BOOST_TEST(fixture.log.contains(" UTC 9:1 simulation server"));
    BOOST_TEST(!fixture.log.contains(" UTC 10:1 simulation server"));
    fixture.notifier.failure.reset();
    fixture.world.advance(15min);
    BOOST_TEST(fixture.notifier.delivered.size() == 50u);
}

BOOST_AUTO_TEST_CASE(cancelled_in_the_middle_of_a_mail_it_ends_and_logs_what_was_not_sent)
{
    Fixture fixture;
    fixture.notifier.hangs = true;
    fixture.start();
    for (int i = 0; i < 3; ++i)
        fixture.note(LoadTransition::reached_maximum);
    auto const began = fixture.world.clock.now();
    fixture.stop();
    BOOST_TEST((fixture.world.clock.now() == began));
    BOOST_TEST((fixture.outcome.error().code() == asio::error::operation_aborted));
    BOOST_TEST(fixture.log.lines.size() == 3u);
    for (auto const& line : fixture.log.lines)
        BOOST_TEST(line.starts_with("Email to admin@b.org not sent (the session server ends): "), line);
    BOOST_TEST(fixture.errors() == 0u);
}

BOOST_AUTO_TEST_CASE(a_digest_that_is_being_collected_is_mailed_when_the_server_ends)
{
    Fixture fixture;
    fixture.notifier.delay = 1s;
    fixture.start();
    fixture.flap(1min);
    BOOST_TEST(fixture.notifier.delivered.size() == 2u);
    fixture.stop();
    BOOST_TEST(fixture.notifier.delivered.size() == 3u);
    BOOST_TEST(fixture.log.lines.empty());
}

BOOST_AUTO_TEST_CASE(a_mail_server_that_is_down_is_not_tried_again_when_the_server_ends)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::unreachable);
    fixture.start();
    fixture.note(LoadTransition::reached_maximum);
    BOOST_TEST(fixture.notifier.attempts.size() == 1u);
    fixture.stop();
    BOOST_TEST(fixture.notifier.attempts.size() == 1u);
    BOOST_TEST(fixture.log.contains("not sent (the session server ends): "));
}

BOOST_AUTO_TEST_CASE(mails_are_counted_by_what_became_of_them)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::unreachable);
    fixture.start();
    fixture.note(LoadTransition::not_responding);
    fixture.world.advance(50s);
    BOOST_TEST(fixture.mail.statistics().waiting == 1u);
    BOOST_TEST(fixture.mail.statistics().failed == 3u); // at 0, 15 and 45 s
    fixture.notifier.failure.reset();
    fixture.world.advance(1min);
    BOOST_TEST(fixture.mail.statistics().waiting == 0u);
    BOOST_TEST(fixture.mail.statistics().sent == 1u);
    BOOST_TEST(fixture.mail.statistics().given_up == 0u);
    fixture.notifier.hangs = true;
    fixture.note(LoadTransition::not_responding, "b:1");
    fixture.stop();
    BOOST_TEST(fixture.mail.statistics().given_up == 1u);
    BOOST_TEST(fixture.mail.statistics().waiting == 0u);
}

BOOST_AUTO_TEST_CASE(new_parameters_hold_for_what_waits_and_it_is_tried_at_once)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::unreachable, "no route");
    fixture.start();
    fixture.note(LoadTransition::not_responding);
    fixture.world.advance(30min);
    auto const attempts = fixture.notifier.attempts.size();
    fixture.notifier.failure = Failure(errc::unreachable, "still none");
    auto next = server();
    next.port_rewrite = false;
    fixture.mail.apply("other@b.org", next);
    fixture.world.settle();
    BOOST_TEST(fixture.notifier.attempts.size() == attempts + 1);
    BOOST_TEST(fixture.log.lines.back() == "Error: unable to send email to other@b.org: still none");
    fixture.notifier.failure.reset();
    fixture.world.advance(15s);
    fixture.note(LoadTransition::working_again);
    BOOST_TEST_REQUIRE(fixture.notifier.delivered.size() == 2u);
    BOOST_TEST(fixture.notifier.delivered[1].text.find("https://h.org:1999/monitor") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(without_an_administrator_what_waits_goes_to_the_log_and_nothing_more_is_taken_in)
{
    Fixture fixture;
    fixture.notifier.failure = Failure(errc::unreachable);
    fixture.start();
    fixture.note(LoadTransition::not_responding);
    fixture.mail.apply("", server());
    BOOST_TEST(fixture.log.lines.back().starts_with(
        "Email to admin@b.org not sent (no recipient is configured any more): "));
    fixture.notifier.failure.reset();
    fixture.note(LoadTransition::working_again);
    fixture.world.advance(1h);
    BOOST_TEST(fixture.notifier.delivered.empty());
    BOOST_TEST(fixture.mail.statistics().waiting == 0u);
}

BOOST_AUTO_TEST_SUITE_END()
