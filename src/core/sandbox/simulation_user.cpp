#include "simulation_user.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace webots_cloud::core {
namespace {

// 0x70000000 to 0x73FFFFFF: above the numbers that systemd gives to containers (up to 0x6FFFFFFF), and below
// those of foreign images (from 0x7FFE0000).
constexpr std::uint32_t first_number = 0x7000'0000;
constexpr std::uint32_t ports = 0x1'0000;
constexpr std::uint64_t turns = 1024;

constexpr unsigned cap_sys_ptrace = 19; // to find the ports that processes of others listen on
constexpr std::array<std::pair<unsigned, std::string_view>, 6> needed{{
    {0, "CAP_CHOWN"},
    {1, "CAP_DAC_OVERRIDE"},
    {5, "CAP_KILL"},
    {6, "CAP_SETGID"},
    {7, "CAP_SETUID"},
    {cap_sys_ptrace, "CAP_SYS_PTRACE"},
}};

std::string_view missing_capability(std::uint64_t capabilities)
{
    for (auto const& [number, name] : needed)
        if ((capabilities >> number & 1) == 0)
            return name;
    return {};
}

} // namespace

result<SimulationUser> choose_simulation_user(SimulationUserContext const& context)
{
    bool const is_named = context.configured != "auto" && context.configured != "none";
    SimulationUser user;
    if (context.configured == "none")
        return user;
    if (is_named && !context.named)
        return Failure(errc::invalid_config, concat("this machine has no user \"", context.configured, "\""));
    if (is_named && context.named->user == context.server)
        return user;
    if (is_named && context.named->user == 0)
        return Failure(errc::invalid_config, "simulations do not become root");
    auto const missing = missing_capability(context.capabilities);
    if (context.server != 0 && !is_named)
        return user;
    if (context.server != 0)
        return Failure(errc::invalid_config, "only a server that runs as root can start simulations as "
                                             "another user");
    if (!missing.empty())
        return Failure(is_named ? errc::invalid_config : errc::unavailable,
                       concat("the server lacks the capability ", missing));
    user.kind = SimulationUser::Kind::of_its_own;
    user.name = "simulation";
    if (context.named && context.named->user != 0) {
        user.kind = SimulationUser::Kind::one;
        user.user = context.named->user;
        user.group = context.named->group;
        user.groups = context.named->groups;
        user.name = context.named->name;
    }
    return user;
}

std::uint32_t own_user_number(std::uint64_t turn, std::uint16_t port)
{
    return first_number + static_cast<std::uint32_t>(turn % turns) * ports + port;
}

std::uint32_t own_user_number(SimulationUser const& user, std::uint64_t turn, std::uint16_t port)
{
    if (user.user_namespace < 0)
        return own_user_number(turn, port);
    auto const own_turns = std::max(user.numbers / ports, std::uint32_t{1});
    return static_cast<std::uint32_t>(turn % own_turns) * ports + port + 1; // 0 is root in there
}

std::string_view shared_user_risk(SimulationUser const& user)
{
    if (user.is_other())
        return {};
    return "can take all that the kernel gives this server's user, epoll watches above all: then it "
           "starts no simulations, and may accept no connections (docs/sandboxes.md, \"Another user\").";
}

std::uint64_t effective_capabilities(std::string_view status)
{
    constexpr std::string_view key = "CapEff:";
    auto const found = status.find(key);
    if (found == std::string_view::npos)
        return 0;
    auto const rest = trim(status.substr(found + key.size(), 32));
    std::uint64_t value = 0;
    std::from_chars(rest.data(), rest.data() + rest.size(), value, 16);
    return value;
}

} // namespace webots_cloud::core
