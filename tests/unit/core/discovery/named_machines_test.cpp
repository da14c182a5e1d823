#include "unit_test.hpp"

#include "core/discovery/named_machines.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::NamedMachines;

BOOST_AUTO_TEST_SUITE(named_machines)

namespace {

constexpr TimePoint start{};

NamedMachines named(std::string const& entry)
{
    ServerSpec spec(entry);
    spec.weight = 2;
    spec.labels = {"gpu"};
    return NamedMachines(spec, *core::parse_machine_name(entry));
}

NameAnswer addresses(std::vector<std::string> found, Duration ttl = 60s)
{
    NameAnswer answer;
    answer.addresses = std::move(found);
    answer.ttl = ttl;
    return answer;
}

NamedService service(std::string target, std::uint16_t priority, std::uint16_t weight)
{
    NamedService found;
    found.target = std::move(target);
    found.port = 2000;
    found.priority = priority;
    found.weight = weight;
    return found;
}

std::string names_of(NamedMachines const& machines)
{
    std::string text;
    for (auto const& machine : machines.machines())
        text += (text.empty() ? "" : " ") + machine.address;
    return text;
}

ServerSpec machine_of(std::vector<ServerSpec> const& machines, std::string_view address)
{
    for (auto const& machine : machines)
        if (machine.address == address)
            return machine;
    BOOST_TEST_REQUIRE(false, address);
    return ServerSpec();
}

} // namespace

BOOST_AUTO_TEST_CASE(every_address_is_a_machine_that_is_treated_as_the_entry_says)
{
    auto machines = named("dns:sim.test:2000");
    BOOST_TEST((machines.due() <= start));
    auto const news = machines.take(addresses({"10.0.0.2", "2001:db8::2", "10.0.0.2"}), start, false);
    BOOST_TEST(news.info == "dns:sim.test:2000 stands for 2 machines: 2 added, 0 removed");
    BOOST_TEST(news.warning == "");
    BOOST_TEST(names_of(machines) == "10.0.0.2:2000 [2001:db8::2]:2000");
    BOOST_TEST(machines.machines().front().weight == 2);
    BOOST_TEST(machines.machines().front().labels.front() == "gpu");
}

BOOST_AUTO_TEST_CASE(a_name_is_looked_up_again_by_its_ttl_within_limits)
{
    auto machines = named("dns:sim.test:2000");
    for (auto const& [ttl, due] :
         {std::pair<Duration, Duration>(0s, 5s), {60s, 60s}, {24h, 300s}, {-1s, 5s}}) {
        machines.take(addresses({"10.0.0.2"}, ttl), start, false);
        BOOST_TEST((machines.due() == start + due));
    }
}

BOOST_AUTO_TEST_CASE(a_machine_goes_when_two_answers_lack_it)
{
    auto machines = named("dns:sim.test:2000");
    machines.take(addresses({"10.0.0.2", "10.0.0.3"}), start, false);
    auto const first = machines.take(addresses({"10.0.0.3"}, 300s), start, false);
    BOOST_TEST(first.info == "");
    BOOST_TEST(names_of(machines) == "10.0.0.2:2000 10.0.0.3:2000");
    BOOST_TEST((machines.due() == start + 30s)); // sooner than the TTL: who is missing may be gone
    machines.take(addresses({"10.0.0.2", "10.0.0.3"}), start, false);
    machines.take(addresses({"10.0.0.3"}), start, false);
    BOOST_TEST(names_of(machines) == "10.0.0.2:2000 10.0.0.3:2000");
    auto const second = machines.take(addresses({"10.0.0.3"}), start, false);
    BOOST_TEST(second.info == "dns:sim.test:2000 stands for 1 machine: 0 added, 1 removed");
    BOOST_TEST(names_of(machines) == "10.0.0.3:2000");
}

BOOST_AUTO_TEST_CASE(that_there_is_no_such_name_is_an_answer)
{
    auto machines = named("dns:sim.test:2000");
    Failure const unknown(errc::not_found, "there is no sim.test");
    machines.take(addresses({"10.0.0.2"}), start, false);
    auto const news = machines.take(unknown, start, false);
    BOOST_TEST(news.warning == "dns:sim.test:2000: there is no sim.test");
    BOOST_TEST(names_of(machines) == "10.0.0.2:2000");
    BOOST_TEST((machines.due() == start + 5s));
    BOOST_TEST(machines.take(unknown, start, false).warning == ""); // it was said
    BOOST_TEST(names_of(machines) == "");
}

BOOST_AUTO_TEST_CASE(while_nobody_answers_the_last_machines_stay_for_an_hour)
{
    auto machines = named("dns:sim.test:2000");
    Failure const silent(errc::unreachable, "no answer");
    machines.take(addresses({"10.0.0.2"}), start, false);
    auto now = start;
    for (auto const pause : {5s, 10s, 20s, 40s, 60s, 60s}) {
        machines.take(silent, now, false);
        BOOST_TEST((machines.due() == now + pause));
        now = machines.due();
    }
    BOOST_TEST(machines.take(silent, start + 1h - 1s, false).warning == "");
    BOOST_TEST(names_of(machines) == "10.0.0.2:2000");
    BOOST_TEST(machines.take(silent, start + 1h, false).warning == "dns:sim.test:2000: no answer");
    BOOST_TEST(names_of(machines) == "");
    machines.take(addresses({"10.0.0.4"}), start + 2h, false);
    BOOST_TEST(names_of(machines) == "10.0.0.4:2000");
    machines.take(silent, start + 2h, false);
    BOOST_TEST((machines.due() == start + 2h + 5s)); // as if it had never failed
}

BOOST_AUTO_TEST_CASE(addresses_of_no_machine_are_left_out_and_that_is_said_once)
{
    auto machines = named("dns:sim.test:2000");
    auto const lie = addresses({"169.254.169.254", "127.0.0.1", "nonsense", "10.0.0.2"});
    BOOST_TEST(machines.take(lie, start, false).warning.starts_with("dns:sim.test:2000: 3 of its answers"));
    BOOST_TEST(machines.take(lie, start, false).warning == "");
    BOOST_TEST(names_of(machines) == "10.0.0.2:2000");
    machines.take(lie, start, true);
    BOOST_TEST(names_of(machines) == "10.0.0.2:2000 127.0.0.1:2000");
}

BOOST_AUTO_TEST_CASE(of_thousands_of_addresses_always_the_same_thousand_are_used)
{
    auto machines = named("dns:crowd.test:2000");
    std::vector<std::string> crowd;
    for (int i = 0; i < 4000; ++i)
        crowd.push_back("10.1." + std::to_string(i / 250) + "." + std::to_string(i % 250));
    auto const news = machines.take(addresses(crowd), start, false);
    BOOST_TEST(news.warning == "dns:crowd.test:2000: it names 4000 machines, of which 1000 are used");
    auto const first = names_of(machines);
    std::reverse(crowd.begin(), crowd.end());
    auto const again = machines.take(addresses(crowd), start, false);
    BOOST_TEST(again.info + again.warning == "");
    BOOST_TEST(names_of(machines) == first);
    BOOST_TEST(machines.machines().size() == 1000);
}

BOOST_AUTO_TEST_CASE(the_machines_of_a_service_have_weights_and_spares)
{
    auto machines = named("srv:_webots._tcp.test");
    NameAnswer answer;
    answer.services = {service("A.test.", 10, 60),   service("b.test", 10, 20),
                       service("zero.test", 10, 0),  service("spare.test", 20, 0),
                       service("localhost", 10, 60), service(".", 0, 0)};
    answer.services.push_back(service("no-port.test", 10, 1));
    answer.services.back().port = 0;
    machines.take(answer, start, false);
    BOOST_TEST(names_of(machines) == "a.test:2000 b.test:2000 spare.test:2000 zero.test:2000");
    auto const found = machines.machines();
    BOOST_TEST(machine_of(found, "a.test:2000").weight == 2 * 1.5); // 60 of 40 in the mean
    BOOST_TEST(machine_of(found, "b.test:2000").weight == 2 * 0.5);
    BOOST_TEST(machine_of(found, "zero.test:2000").weight == 2 * 0.1);
    BOOST_TEST(machine_of(found, "spare.test:2000").weight == 2);
    BOOST_TEST(!machine_of(found, "a.test:2000").drain);
    BOOST_TEST(machine_of(found, "spare.test:2000").drain);
    BOOST_TEST(machines.has_spares());
    auto const without =
        machines.machines([](std::string_view address) { return address != "spare.test:2000"; });
    BOOST_TEST(!machine_of(without, "spare.test:2000").drain);
    BOOST_TEST(!machine_of(without, "a.test:2000").drain); // it will be there first
    auto const nobody = machines.machines([](std::string_view) { return true; });
    BOOST_TEST(!machine_of(nobody, "a.test:2000").drain);
    BOOST_TEST(machine_of(nobody, "spare.test:2000").drain);
}

BOOST_AUTO_TEST_SUITE_END()
