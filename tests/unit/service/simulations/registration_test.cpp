#include "service/run.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/notices/registration_form.hpp"

#include <webots_cloud/registration.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/world.hpp>

#include <optional>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 11 and quirk Q16.
BOOST_AUTO_TEST_SUITE(registration)

namespace {

struct Fixture
{
    explicit Fixture(std::vector<std::string> registries) { config.notify = std::move(registries); }
    ~Fixture() { world.run(tasks.end()); }

    void start()
    {
        registration.emplace(config, url, http, world.clock, log.logger());
        tasks.spawn(run(*registration));
    }

    testing::World world;
    testing::RecordingLog log;
    testing::ScriptedHttp http{world.clock};
    SimulationServiceConfig config;
    std::string url;
    std::optional<Registration> registration;
    async::TaskGroup tasks{world.executor()};
};

} // namespace

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
    Fixture fixture({"http://r/"});
    fixture.http.expect("POST http://r/").reply(200, "{\"error\":\"Server name mismatch: x\"}");
    fixture.url = "https://host/2000";
    fixture.config.repositories.share_idle_time = 50;
    fixture.start();
    fixture.world.advance(24h);
    BOOST_TEST_REQUIRE(fixture.http.requests().size() == 1u); // no heartbeat, no second try
    auto const& request = fixture.http.requests().front();
    BOOST_TEST(request.body == "url=https%3A%2F%2Fhost%2F2000&shareIdleTime=50&allowedRepositories=");
    BOOST_TEST(request.headers.front().first == "Content-Type");
    BOOST_TEST(request.headers.front().second == "application/x-www-form-urlencoded");
    BOOST_TEST(fixture.log.contains("Registered at http://r/: {\"error\":\"Server name mismatch: x\"}"));
}

BOOST_AUTO_TEST_CASE(a_registry_that_hangs_is_given_up_and_the_end_of_the_server_waits_for_none)
{
    Fixture fixture({"http://r/"});
    fixture.http.expect("POST http://r/").hang();
    fixture.http.expect("POST http://r/").hang();
    fixture.start();
    fixture.world.advance(10s);
    BOOST_TEST(fixture.log.contains("Could not register at http://r/: "));
    fixture.world.advance(6s);
    BOOST_TEST(fixture.http.requests().size() == 2u);
    fixture.tasks.cancel_all();
    fixture.world.settle();
    BOOST_TEST(fixture.tasks.size() == 0u);
}

BOOST_AUTO_TEST_CASE(an_unreachable_registry_is_tried_again_ever_less_often_and_delays_no_other)
{
    Fixture fixture({"http://down/", "http://up/"});
    for (int i = 0; i < 3; ++i)
        fixture.http.expect("POST http://down/").fail(errc::unreachable);
    fixture.http.expect("POST http://down/").reply(503, "");
    fixture.http.expect("POST http://down/").reply(201, "published\n"); // any success is one
    fixture.http.expect("POST http://up/").reply(200, "published");
    fixture.start();
    fixture.world.settle();
    BOOST_TEST(fixture.log.contains("Registered at http://up/: published"));
    fixture.world.advance(5s + 10s + 20s + 40s - 1s);
    BOOST_TEST(fixture.http.requests().size() == 5u);
    BOOST_TEST(!fixture.log.contains("Registered at http://down/"));
    fixture.world.advance(1s);
    BOOST_TEST(fixture.log.contains("Registered at http://down/: published"));
    BOOST_TEST(fixture.http.unused() == "");
    fixture.world.advance(1h);
    BOOST_TEST(fixture.http.requests().size() == 6u);
}

BOOST_AUTO_TEST_CASE(registries_are_told_again_when_what_they_know_has_changed_and_only_then)
{
    Fixture fixture({"http://up/", "http://down/"});
    fixture.http.expect("POST http://up/").reply(200, "published");
    fixture.http.expect("POST http://up/").reply(200, "published");
    fixture.http.expect("POST http://down/").fail(errc::unreachable);
    fixture.http.expect("POST http://down/").reply(200, "published");
    fixture.start();
    fixture.world.advance(1s);
    fixture.config.notify.clear();
    fixture.registration->apply(fixture.config); // registries are not taken over
    fixture.world.advance(1s);
    BOOST_TEST(fixture.http.requests().size() == 2u);
    fixture.config.repositories.share_idle_time = 12.5;
    fixture.config.repositories.allowed = {"a"};
    fixture.registration->apply(fixture.config);
    fixture.world.advance(1h);
    BOOST_TEST_REQUIRE(fixture.http.requests().size() ==
                       4u); // once more each: the retry of the one that was down is not waited for
    for (std::size_t i = 2; i < 4; ++i)
        BOOST_TEST(fixture.http.requests()[i].body == "url=&shareIdleTime=12.5&allowedRepositories=a");
}

BOOST_AUTO_TEST_CASE(a_change_while_a_registry_is_being_asked_counts)
{
    Fixture fixture({"http://r/"});
    fixture.http.expect("POST http://r/").after(5s).reply(200, "old");
    fixture.http.expect("POST http://r/").after(5s).reply(200, "new");
    fixture.start();
    fixture.world.advance(1s);
    fixture.config.repositories.share_idle_time = 0;
    fixture.registration->apply(fixture.config);
    fixture.world.advance(1h);
    BOOST_TEST(fixture.http.requests().size() == 2u);
    BOOST_TEST(!fixture.log.contains("Registered at http://r/: old"));
    BOOST_TEST(fixture.log.contains("Registered at http://r/: new"));
}

BOOST_AUTO_TEST_SUITE_END()
