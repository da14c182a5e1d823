// What name servers answer when they are asked for the machines of a service (SRV): whatever it is, the
// machines that come of it have addresses like any in a configuration.
#include "fuzz.hpp"

#include "adapters/names/service_answer.hpp"
#include "core/discovery/named_machines.hpp"
#include "core/text.hpp"

using namespace webots_cloud;

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    core::NamedMachines machines(ServerSpec("srv:_w._tcp.test"),
                                 *core::parse_machine_name("srv:_w._tcp.test"));
    auto const answer = adapters::services_of("_w._tcp.test", {data, size});
    if (answer)
        fuzz::require(answer->ttl >= Duration::zero() && answer->services.size() <= size);
    auto const news = machines.take(answer, TimePoint(), false);
    fuzz::require(answer.has_value() || machines.machines().empty());
    fuzz::require(core::printable(news.info, news.info.size()) == news.info);
    for (auto const& machine : machines.machines()) {
        auto const colon = machine.address.rfind(':');
        fuzz::require(colon != std::string::npos && core::parse_port(machine.address.substr(colon + 1)) != 0);
        auto const host = machine.address.substr(0, colon);
        fuzz::require(core::is_machine_host(host, false));
        fuzz::require(core::parse_machine_name(core::concat("srv:", host)).has_value());
        fuzz::require(machine.weight >= 0.1 && machine.weight <= 10);
    }
    return 0;
}
