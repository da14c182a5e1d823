#include "service/run.hpp"
#include "unit_test.hpp"

#include "async/task_group.hpp"
#include "core/discovery/announcements.hpp"

#include <webots_cloud/announcing.hpp>
#include <webots_cloud/machine_discovery.hpp>
#include <webots_cloud/testing/recording_log.hpp>
#include <webots_cloud/testing/scripted_http.hpp>
#include <webots_cloud/testing/world.hpp>

#include <algorithm>
#include <array>
#include <map>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;

BOOST_AUTO_TEST_SUITE(machine_discovery)

namespace {

/// Answers from a table; names without an entry hang.
class ScriptedNames final : public NameService
{
public:
    explicit ScriptedNames(Clock& clock) : clock_(clock) {}

    asio::awaitable<result<NameAnswer>> addresses(std::string name, TimePoint deadline) override
    {
        ++lookups[name];
        auto const found = answers.find(name);
        if (found != answers.end())
            co_return found->second;
        auto const waited = co_await clock_.wait_until(deadline);
        if (!waited)
            co_return waited.error();
        co_return Failure(errc::unreachable, "no answer in time");
    }
    asio::awaitable<result<NameAnswer>> services(std::string name, TimePoint deadline) override
    {
        return addresses(std::move(name), deadline);
    }

    std::map<std::string, result<NameAnswer>> answers;
    std::map<std::string, int> lookups;

private:
    Clock& clock_;
};

NameAnswer answer_of(std::vector<std::string> addresses, Duration ttl = 10s)
{
    NameAnswer answer;
    answer.addresses = std::move(addresses);
    answer.ttl = ttl;
    return answer;
}

std::string no_mac(std::string_view message)
{
    return std::string(message);
}

struct DiscoveryFixture
{
    explicit DiscoveryFixture(std::vector<std::string> const& entries, std::size_t max_announced = 10'000,
                              bool loopback = false)
        : discovery(entries_of(entries), loopback, names, world.clock, log.logger(), hooks(max_announced))
    {}
    ~DiscoveryFixture() { world.run(tasks.end()); }

    static std::vector<ServerSpec> entries_of(std::vector<std::string> const& addresses)
    {
        std::vector<ServerSpec> entries;
        for (auto const& address : addresses)
            entries.emplace_back(address);
        return entries;
    }

    void start()
    {
        known = discovery.servers();
        tasks.spawn(run(discovery));
    }

    MachineDiscoveryHooks hooks(std::size_t max_announced)
    {
        MachineDiscoveryHooks made;
        made.max_announced = max_announced;
        made.changed = [this](std::vector<ServerChange> const& several) {
            ++changes;
            for (auto const& change : several)
                carry_out(change);
            told = text_of(known);
        };
        made.unreachable = [this] { return unreachable; };
        made.mac = no_mac;
        made.receiver = "this-run";
        return made;
    }

    void carry_out(ServerChange const& change)
    {
        std::erase_if(known,
                      [&](ServerSpec const& server) { return server.address == change.server.address; });
        if (change.kind != ServerChange::Kind::removed)
            known.insert(std::ranges::find(known, change.before, &ServerSpec::address), change.server);
    }

    /// As was told of a machine.
    std::string found_by(std::string_view address) const
    {
        return std::ranges::find(known, address, &ServerSpec::address)->found_by;
    }

    static std::string text_of(std::vector<ServerSpec> const& servers)
    {
        std::string text;
        for (auto const& server : servers)
            text += (text.empty() ? "" : " ") + server.address + (server.drain ? "-" : "");
        return text;
    }

    int announce(std::string const& query, std::string const& signature)
    {
        std::array<std::pair<std::string_view, std::string_view>, 1> const headers{
            std::pair<std::string_view, std::string_view>("Authorization", signature)};
        IncomingRequest request;
        request.method = "POST";
        request.query = query;
        request.headers = headers;
        request.client = "192.0.2.9";
        return static_cast<int>(discovery.take_announcement(request).status);
    }
    int announce(std::string const& machine, bool is_goodbye = false, Duration since = 0s)
    {
        core::Announcement announcement;
        announcement.machine = machine;
        announcement.at = world.clock.wall() + std::chrono::duration_cast<WallTime::duration>(since);
        announcement.receiver = "this-run";
        announcement.is_goodbye = is_goodbye;
        auto const query = core::announcement_query(announcement);
        return announce(query, core::sign_announcement(no_mac, query));
    }

    testing::World world;
    testing::RecordingLog log;
    ScriptedNames names{world.clock};
    int changes = 0;
    std::vector<ServerSpec> known; ///< By what was told.
    std::string told;
    std::unordered_set<std::string> unreachable;
    MachineDiscovery discovery;
    async::TaskGroup tasks{world.executor()};
};

} // namespace

BOOST_AUTO_TEST_CASE(machines_come_in_place_of_their_names_and_follow_them)
{
    DiscoveryFixture fixture({"a:1", "dns:sim.test:2000", "10.0.0.3:2000"});
    fixture.names.answers.emplace("sim.test", answer_of({"10.0.0.2", "10.0.0.3"}));
    BOOST_TEST(fixture.text_of(fixture.discovery.servers()) == "a:1 10.0.0.3:2000");
    fixture.start();
    fixture.world.advance(2s);
    BOOST_TEST(fixture.told == "a:1 10.0.0.2:2000 10.0.0.3:2000");
    BOOST_TEST(fixture.found_by("a:1") == "");
    BOOST_TEST(fixture.found_by("10.0.0.2:2000") == "dns:sim.test:2000");
    BOOST_TEST(fixture.changes == 1);
    fixture.names.answers.at("sim.test") = answer_of({"10.0.0.9"});
    fixture.world.advance(12s);
    BOOST_TEST(fixture.told == "a:1 10.0.0.2:2000 10.0.0.3:2000 10.0.0.9:2000");
    fixture.world.advance(12s);
    BOOST_TEST(fixture.told == "a:1 10.0.0.9:2000 10.0.0.3:2000"); // which is an entry itself
    auto const changes = fixture.changes;
    fixture.world.advance(1min);
    BOOST_TEST(fixture.changes == changes); // nothing has
    BOOST_TEST(fixture.names.lookups["sim.test"] >= 8);
}

BOOST_AUTO_TEST_CASE(a_name_that_hangs_delays_no_other_and_is_asked_once_at_a_time)
{
    DiscoveryFixture fixture({"dns:hole.test:2000", "dns:sim.test:2000"});
    fixture.names.answers.emplace("sim.test", answer_of({"10.0.0.2"}));
    fixture.start();
    fixture.world.advance(19s);
    BOOST_TEST(fixture.told == "10.0.0.2:2000");
    BOOST_TEST(fixture.names.lookups["hole.test"] == 1);
    fixture.world.advance(1min);
    BOOST_TEST(fixture.log.contains("dns:hole.test:2000: no answer in time"));
}

BOOST_AUTO_TEST_CASE(a_reload_keeps_what_is_known_of_names_that_stay)
{
    DiscoveryFixture fixture({"dns:sim.test:2000", "dns:old.test:2000"});
    fixture.names.answers.emplace("sim.test", answer_of({"10.0.0.2"}, 5min));
    fixture.names.answers.emplace("old.test", answer_of({"10.0.0.3"}));
    fixture.start();
    fixture.announce("b:1");
    fixture.world.advance(2s);
    auto entries = fixture.entries_of({"a:1", "dns:sim.test:2000"});
    entries.back().drain = true;
    fixture.discovery.apply(entries, false);
    BOOST_TEST(fixture.text_of(fixture.discovery.servers()) == "a:1 10.0.0.2:2000- b:1");
    fixture.world.advance(20s);
    BOOST_TEST(fixture.names.lookups["sim.test"] == 1);
    BOOST_TEST(fixture.names.lookups["old.test"] == 1);
}

BOOST_AUTO_TEST_CASE(spares_are_used_while_no_other_machine_of_their_service_can_be_reached)
{
    DiscoveryFixture fixture({"srv:_webots._tcp.test"});
    NameAnswer answer;
    for (auto const* const target : {"first.test", "spare.test"}) {
        NamedService service;
        service.target = target;
        service.port = 2000;
        service.priority = target[0] == 's' ? 20 : 10;
        answer.services.push_back(service);
    }
    answer.ttl = 5min;
    fixture.names.answers.emplace("_webots._tcp.test", answer);
    fixture.start();
    fixture.world.advance(2s);
    BOOST_TEST(fixture.told == "first.test:2000 spare.test:2000-");
    fixture.unreachable = {"first.test:2000"};
    fixture.world.advance(2s);
    BOOST_TEST(fixture.told == "first.test:2000 spare.test:2000");
    fixture.unreachable = {};
    fixture.world.advance(2s);
    BOOST_TEST(fixture.told == "first.test:2000 spare.test:2000-");
}

BOOST_AUTO_TEST_CASE(so_many_machines_announce_themselves_and_one_line_says_that_others_were_refused)
{
    DiscoveryFixture fixture({}, 3);
    for (int i = 0; i < 10; ++i)
        BOOST_TEST(fixture.announce("m" + std::to_string(i) + ":1") == (i < 3 ? 200 : 503));
    BOOST_TEST(fixture.log.contains("LimitNOFILE="));
    BOOST_TEST(fixture.log.contains("m3:1 announces itself and is refused"));
    BOOST_TEST(!fixture.log.contains("m4:1"));
}

BOOST_AUTO_TEST_CASE(what_others_name_is_not_here_unless_the_operator_says_so)
{
    for (bool const loopback : {false, true}) {
        DiscoveryFixture fixture({"a:1", "dns:sim.test:2000"}, 10, loopback);
        fixture.names.answers.emplace("sim.test", answer_of({"10.0.0.2"}));
        fixture.start();
        BOOST_TEST(fixture.announce("b:1") == 200);
        fixture.world.advance(3s);
        std::map<std::string, bool> elsewhere;
        for (auto const& machine : fixture.known)
            elsewhere[machine.address] = machine.elsewhere;
        BOOST_TEST_REQUIRE(elsewhere.size() == 3u);
        BOOST_TEST(!elsewhere["a:1"]);
        BOOST_TEST(elsewhere["b:1"] == !loopback);
        BOOST_TEST(elsewhere["10.0.0.2:2000"] == !loopback);
    }
}

BOOST_AUTO_TEST_CASE(announced_machines_come_and_go)
{
    DiscoveryFixture fixture({"a:1"});
    fixture.start();
    BOOST_TEST(fixture.announce("b:1") == 200);
    BOOST_TEST(fixture.announce("a:1") == 200);
    fixture.world.advance(1s);
    BOOST_TEST(fixture.told == "a:1 b:1");
    BOOST_TEST(fixture.found_by("b:1") == "announced");
    BOOST_TEST(fixture.found_by("a:1") == "");
    BOOST_TEST(fixture.announce("b:1") == 200);
    fixture.world.advance(29s);
    BOOST_TEST(fixture.told == "a:1 b:1");
    fixture.world.advance(2s);
    BOOST_TEST(fixture.told == "a:1");
    BOOST_TEST(fixture.log.contains("b:1 no longer announces itself, and is forgotten"));
    fixture.announce("b:1");
    fixture.world.advance(1s);
    BOOST_TEST(fixture.told == "a:1 b:1");
    BOOST_TEST(fixture.announce("b:1", true) == 200);
    fixture.world.advance(1s);
    BOOST_TEST(fixture.told == "a:1");
    BOOST_TEST(fixture.announce("b:1", false, -1s) == 409);
}

BOOST_AUTO_TEST_CASE(many_machines_are_told_of_some_at_a_time_while_others_come_and_go)
{
    DiscoveryFixture fixture({});
    fixture.start();
    fixture.world.advance(500ms);
    for (int i = 10; i < 45; ++i)
        BOOST_TEST(fixture.announce("m" + std::to_string(i) + ":1") == 200);
    fixture.world.advance(500ms);
    BOOST_TEST(fixture.known.size() == 10u);
    BOOST_TEST(fixture.announce("m10:1", true, 1ms) == 200); // this one is known already
    BOOST_TEST(fixture.announce("m44:1", true, 1ms) == 200); // and this one is not yet
    BOOST_TEST(fixture.announce("a:1") == 200);
    BOOST_TEST(fixture.announce("m43:1", true, 1ms) == 200); // comes back before anybody is told
    BOOST_TEST(fixture.announce("m43:1", false, 2ms) == 200);
    fixture.world.advance(2ms);
    BOOST_TEST(fixture.known.size() == 18u);
    BOOST_TEST(fixture.known.front().address == "a:1");
    fixture.world.advance(5ms);
    BOOST_TEST(fixture.known.size() == 34u);
    BOOST_TEST(fixture.changes == 4);
    BOOST_TEST(fixture.told == fixture.text_of(fixture.discovery.servers()));
    BOOST_TEST(std::ranges::is_sorted(fixture.known, {}, &ServerSpec::address));
    BOOST_TEST(fixture.known.back().address == "m43:1");
    fixture.world.advance(2s);
    BOOST_TEST(fixture.changes == 4);
}

BOOST_AUTO_TEST_CASE(a_reload_in_the_middle_takes_the_rest_over_at_once)
{
    DiscoveryFixture fixture({});
    for (int i = 0; i < 15; ++i)
        (void)fixture.announce("m" + std::to_string(i) + ":1");
    fixture.start();
    fixture.world.advance(0s);
    BOOST_TEST(fixture.known.size() == 10u);
    fixture.discovery.apply(fixture.entries_of({"a:1"}), false);
    BOOST_TEST(fixture.discovery.servers().size() == 16u);
    fixture.world.advance(2s);
    BOOST_TEST(fixture.changes == 1);
}

BOOST_AUTO_TEST_CASE(machines_are_reached_inside_where_their_entries_say_so)
{
    DiscoveryFixture fixture({});
    auto entries = fixture.entries_of({"dns:sim.test:2000", "announced"});
    entries[0].internal_address = "https";
    entries[1].internal_address = "http";
    entries[1].labels = {"gpu"};
    fixture.discovery.apply(entries, false);
    fixture.names.answers.emplace("sim.test", answer_of({"10.0.0.2"}));
    fixture.start();
    BOOST_TEST(fixture.announce("10.0.0.7:3000") == 200);
    BOOST_TEST(fixture.announce("sim7.test:3000") == 403); // who knows where that leads tomorrow
    BOOST_TEST(fixture.announce("sim7.test:3000", true, 1s) == 200);
    fixture.world.advance(2s);
    auto const& servers = fixture.discovery.servers();
    BOOST_TEST_REQUIRE(servers.size() == 2);
    BOOST_TEST(servers[0].address == "10.0.0.2:2000");
    BOOST_TEST(servers[0].internal_address == "https://10.0.0.2:2000");
    BOOST_TEST(servers[0].internal_name == "sim.test");
    BOOST_TEST(servers[0].has_own_path);
    BOOST_TEST(servers[1].address == "10.0.0.7:3000");
    BOOST_TEST(servers[1].internal_address == "10.0.0.7:3000");
    BOOST_TEST(servers[1].labels.front() == "gpu");
    BOOST_TEST(servers[1].found_by == "announced");
    fixture.discovery.apply(fixture.entries_of({"announced"}), false); // browsers reach them themselves
    BOOST_TEST(fixture.text_of(fixture.discovery.servers()) == "10.0.0.7:3000");
    BOOST_TEST(!fixture.discovery.servers().front().has_own_path);
}

BOOST_AUTO_TEST_CASE(what_is_not_signed_or_makes_no_sense_is_refused)
{
    DiscoveryFixture fixture({});
    std::string const query = "machine=b%3A1&at=1&to=this-run";
    BOOST_TEST(fixture.announce(query, "") == 403);
    BOOST_TEST(fixture.announce(query, core::sign_announcement(no_mac, query + "0")) == 403);
    BOOST_TEST(fixture.log.contains("An announcement of 192.0.2.9 was refused"));
    BOOST_TEST(fixture.announce("b", core::sign_announcement(no_mac, "b")) == 400);
    BOOST_TEST(fixture.announce(query, core::sign_announcement(no_mac, query)) == 409); // of 1970
    BOOST_TEST(fixture.announce("localhost:2000") == 403);
    std::string const huge(2000, 'x');
    BOOST_TEST(fixture.announce(huge, core::sign_announcement(no_mac, huge)) == 403);
}

BOOST_AUTO_TEST_CASE(a_machine_announces_itself_every_ten_seconds_and_says_goodbye)
{
    DiscoveryFixture fixture({});
    testing::ScriptedHttp http(fixture.world.clock);
    std::string const url = "http://session:1999/api/machines?machine=sim%3A2000&at=";
    auto const at = [&](Duration since) {
        auto const time = fixture.world.clock.wall().time_since_epoch() + since;
        return std::to_string(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
    };
    http.expect("POST " + url + at(0s)).fail(errc::unreachable);
    http.expect("POST " + url + at(10s)).reply(421, core::receiver_answer("before"));
    http.expect("POST " + url + at(10s + 1ms) + "&to=before").reply(200, "known");
    http.expect("POST " + url + at(20s) + "&to=before").reply(421, core::receiver_answer("this-run"));
    http.expect("POST " + url + at(20s + 1ms) + "&to=this-run").reply(200, "known");
    http.expect("POST " + url + at(21s) + "&to=this-run&goodbye").reply(200, "known");
    Announcing announcing({"http://session:1999"}, "sim:2000", http, fixture.world.clock,
                          fixture.log.logger(), no_mac);
    async::TaskGroup tasks(fixture.world.executor());
    tasks.spawn(run(announcing));
    fixture.world.advance(5s);
    BOOST_TEST(fixture.log.contains("Could not announce this server to http://session:1999"));
    fixture.world.advance(16s);
    BOOST_TEST(fixture.log.contains("Announced to http://session:1999"));
    fixture.world.run(tasks.end());
    BOOST_TEST(http.unused() == "");
    auto const& request = http.requests().back();
    auto const query = request.url.substr(request.url.find('?') + 1);
    BOOST_TEST(fixture.announce(query, request.headers.front().second) == 200);
}

BOOST_AUTO_TEST_SUITE_END()
