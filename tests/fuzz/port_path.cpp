// Paths that name a port or a machine or carry a ticket, and the Host of those who are led to https: they
// lead to a listed machine or nowhere, and start nothing without the secret.
#include "fuzz.hpp"

#include "core/access/forwarding.hpp"
#include "core/access/https_address.hpp"
#include "core/access/machine_paths.hpp"
#include "core/access/tickets.hpp"
#include "core/simulation/public_base.hpp"

using namespace webots_cloud;

namespace {

core::ForwardingTable table()
{
    ServerSpec server("sim.example.org/2000");
    server.internal_address = "10.0.0.2:2000";
    server.first_port = 2001;
    server.last_port = 2009;
    return core::ForwardingTable({server});
}

/// One that has answered, at `/machine/aaaaaaaaaaaaaaaaaaaaaaaa`.
struct FoundMachine
{
    FoundMachine()
    {
        ServerSpec server("10.0.0.2:2000");
        server.internal_address = "10.0.0.2:2000";
        server.has_own_path = true;
        fleet.add_observer(paths);
        fleet.put(server);
        paths.answered("10.0.0.2:2000", true);
    }

    Fleet fleet{[](std::string_view) { return std::string(32, '\0'); }};
    core::MachinePaths paths;
};

void check_target(std::string_view target, std::string_view path)
{
    fuzz::require(target == "/" || path.ends_with(target));
    fuzz::require(!target.starts_with("/metrics") || target.size() > 8);
    fuzz::require(target != "/api" && !target.starts_with("/api/"));
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    static auto const machines = table();
    static FoundMachine const found_machine;
    static core::TicketBook book([](std::string_view) { return std::string(32, 'x'); },
                                 {"sim.example.org:2000"});
    static core::SiteAccess const site(core::Reach::everybody, {"sim.example.org"}, nullptr);
    auto const path = fuzz::text_of(data, size);
    if (auto const target = machines.find(path, "")) {
        auto const& machine = target->machine;
        fuzz::require(machine.host == "10.0.0.2" && machine.port >= 2000 && machine.port <= 2009);
        check_target(target->target, path);
    } else if (!path.empty()) {
        fuzz::require(path != "/2000/client");
    }
    if (auto const found = found_machine.paths.find(path, "")) {
        fuzz::require(found->target && found->target->machine.host == "10.0.0.2" &&
                      found->target->machine.port == 2000);
        fuzz::require(std::string_view(path).starts_with(found->path));
        check_target(found->target->target, path);
    }
    if (auto const base = core::parse_public_base(path))
        fuzz::require(*base == path && base->find_first_of("?#@\\ \r\n\"<>") == std::string::npos);
    auto const verdict = book.redeem(core::ticket_in(path), WallTime(std::chrono::hours(400'000)));
    fuzz::require(verdict != core::TicketVerdict::accepted || core::ticket_in(path).size() == 75);
    fuzz::require(core::challenge_in(path).find_first_of("./%") == std::string_view::npos);
    auto const address = core::https_address(path, site, "sim.example.org", 443, "/x");
    fuzz::require(address.starts_with("https://") && address.ends_with("/x"));
    fuzz::require(address.find_first_of("@ \r\n") == std::string::npos);
    return 0;
}
