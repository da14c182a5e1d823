#include "service/run.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/notices/registration_form.hpp"

#include <webots_cloud/registration.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/world.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 11 and quirk Q16.
BOOST_AUTO_TEST_SUITE(registration)

BOOST_AUTO_TEST_CASE(the_form_is_what_registries_have_always_got)
{
    BOOST_TEST(
        core::registration_form("https://host/2000", 50, {"https://github.com/a", "https://github.com/b"}) ==
        "url=https%3A%2F%2Fhost%2F2000&shareIdleTime=50&allowedRepositories="
        "https%3A%2F%2Fgithub.com%2Fa%2Chttps%3A%2F%2Fgithub.com%2Fb");
    BOOST_TEST(core::registration_form("http://h:1", 12.5, {}) ==
               "url=http%3A%2F%2Fh%3A1&shareIdleTime=12.5&allowedRepositories=");
}

BOOST_AUTO_TEST_CASE(a_registry_is_asked_once_by_a_form_and_its_answer_logged_but_not_interpreted)
{
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http(world.clock);
    http.expect("POST http://r/").reply(200, "{\"error\":\"Server name mismatch: x\"}");
    RegistrationParams params;
    params.registries = {"http://r/"};
    params.url = "https://host/2000";
    params.repositories.share_idle_time = 50;
    Registration registration(params, http, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(registration));
    world.advance(24h);
    BOOST_TEST_REQUIRE(http.requests().size() == 1u); // no heartbeat, no second try
    auto const& request = http.requests().front();
    BOOST_TEST(request.body == "url=https%3A%2F%2Fhost%2F2000&shareIdleTime=50&allowedRepositories=");
    BOOST_TEST(request.headers.front().first == "Content-Type");
    BOOST_TEST(request.headers.front().second == "application/x-www-form-urlencoded");
    BOOST_TEST(log.contains("Registered at http://r/: {\"error\":\"Server name mismatch: x\"}"));
    tasks.cancel_all();
    world.run(tasks.join());
}

BOOST_AUTO_TEST_CASE(a_registry_that_hangs_is_given_up_and_the_end_of_the_server_waits_for_none)
{
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http(world.clock);
    http.expect("POST http://r/").hang();
    http.expect("POST http://r/").hang();
    RegistrationParams params;
    params.registries = {"http://r/"};
    Registration registration(params, http, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(registration));
    world.advance(10s);
    BOOST_TEST(log.contains("Could not register at http://r/: "));
    world.advance(6s);
    BOOST_TEST(http.requests().size() == 2u);
    tasks.cancel_all();
    world.settle();
    BOOST_TEST(tasks.size() == 0u);
}

BOOST_AUTO_TEST_CASE(an_unreachable_registry_is_tried_again_ever_less_often_and_delays_no_other)
{
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http(world.clock);
    for (int i = 0; i < 3; ++i)
        http.expect("POST http://down/").fail(errc::unreachable);
    http.expect("POST http://down/").reply(503, "");
    http.expect("POST http://down/").reply(201, "published\n"); // any success is one
    http.expect("POST http://up/").reply(200, "published");
    RegistrationParams params;
    params.registries = {"http://down/", "http://up/"};
    Registration registration(params, http, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(registration));
    world.settle();
    BOOST_TEST(log.contains("Registered at http://up/: published"));
    world.advance(5s + 10s + 20s + 40s - 1s);
    BOOST_TEST(http.requests().size() == 5u);
    BOOST_TEST(!log.contains("Registered at http://down/"));
    world.advance(1s);
    BOOST_TEST(log.contains("Registered at http://down/: published"));
    BOOST_TEST(http.unused() == "");
    world.advance(1h);
    BOOST_TEST(http.requests().size() == 6u);
    tasks.cancel_all();
    world.run(tasks.join());
}

BOOST_AUTO_TEST_CASE(registries_are_told_again_when_what_they_know_has_changed_and_only_then)
{
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http(world.clock);
    http.expect("POST http://up/").reply(200, "published");
    http.expect("POST http://up/").reply(200, "published");
    http.expect("POST http://down/").fail(errc::unreachable);
    http.expect("POST http://down/").reply(200, "published");
    RegistrationParams params;
    params.registries = {"http://up/", "http://down/"};
    Registration registration(params, http, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(registration));
    world.advance(1s);
    params.registries.clear();
    params.url = "http://elsewhere";
    registration.apply(params); // registries and address are not taken over
    world.advance(1s);
    BOOST_TEST(http.requests().size() == 2u);
    params.repositories.share_idle_time = 12.5;
    params.repositories.allowed = {"a"};
    registration.apply(params);
    world.advance(1h);
    BOOST_TEST_REQUIRE(http.requests().size() ==
                       4u); // once more each: the retry of the one that was down is not waited for
    for (std::size_t i = 2; i < 4; ++i)
        BOOST_TEST(http.requests()[i].body == "url=&shareIdleTime=12.5&allowedRepositories=a");
    tasks.cancel_all();
    world.run(tasks.join());
}

BOOST_AUTO_TEST_CASE(a_change_while_a_registry_is_being_asked_counts)
{
    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http(world.clock);
    http.expect("POST http://r/").after(5s).reply(200, "old");
    http.expect("POST http://r/").after(5s).reply(200, "new");
    RegistrationParams params;
    params.registries = {"http://r/"};
    Registration registration(params, http, world.clock, log.logger());
    async::TaskGroup tasks(world.executor());
    tasks.spawn(run(registration));
    world.advance(1s);
    params.repositories.share_idle_time = 0;
    registration.apply(params);
    world.advance(1h);
    BOOST_TEST(http.requests().size() == 2u);
    BOOST_TEST(!log.contains("Registered at http://r/: old"));
    BOOST_TEST(log.contains("Registered at http://r/: new"));
    tasks.cancel_all();
    world.run(tasks.join());
}

BOOST_AUTO_TEST_SUITE_END()
