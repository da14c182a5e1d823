#include "simulation_user.hpp"

#include "core/sandbox/simulation_user.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/error.hpp>

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using core::concat;

/// The groups that may use this machine's graphics processors.
std::vector<std::uint32_t> graphics_groups()
{
    std::vector<std::uint32_t> groups;
    std::error_code failed;
    auto const add = [&groups](fs::path const& path) {
        struct stat status;
        if (::stat(path.c_str(), &status) == 0 && S_ISCHR(status.st_mode) && status.st_gid != 0 &&
            (status.st_mode & S_IRGRP) != 0 &&
            std::find(groups.begin(), groups.end(), status.st_gid) == groups.end())
            groups.push_back(status.st_gid);
    };
    for (auto const& device : fs::directory_iterator("/dev/dri", failed))
        add(device.path());
    for (auto const* device : {"/dev/nvidiactl", "/dev/nvidia0", "/dev/nvidia-uvm"})
        add(device);
    return groups;
}

std::uint64_t our_capabilities()
{
    std::ifstream file("/proc/self/status");
    std::string const status{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    return core::effective_capabilities(status);
}

result<SimulationUser> choose(SimulationConfig const& config, SandboxContext const& context)
{
    core::SimulationUserContext facts;
    facts.configured = config.simulation_user;
    facts.server = ::geteuid();
    facts.capabilities = our_capabilities();
    auto const name =
        config.simulation_user == "auto" ? std::string(core::usual_simulation_user) : config.simulation_user;
    if (auto const account = find_account(name)) {
        facts.named.emplace();
        facts.named->name = name;
        facts.named->user = account->user;
        facts.named->group = account->group;
        facts.named->groups = account->groups;
    }
    auto user = core::choose_simulation_user(facts);
    if (!user || !user->is_other())
        return user;
    for (auto const group : graphics_groups())
        if (std::find(user->groups.begin(), user->groups.end(), group) == user->groups.end())
            user->groups.push_back(group);
    std::error_code failed;
    user->visible = {context.simulator.parent_path(), context.guard};
    auto const real = fs::weakly_canonical(context.simulator, failed).parent_path();
    if (!failed && real != user->visible.front())
        user->visible.push_back(real);
    return user;
}

/// Whether simulations can run so, and can't do what this is for.
asio::awaitable<result<>> check(SimulationUser const& user, SandboxContext const& context,
                                ProcessHost& processes, Clock& clock)
{
    auto const secret = context.state / "user-check.secret";
    auto const instance = context.state / "user-check";
    std::error_code failed;
    fs::remove_all(instance, failed); // of a server that has died here
    fs::create_directory(instance, failed);
    std::ofstream(secret) << "secret";
    fs::permissions(secret, fs::perms::owner_read | fs::perms::owner_write, failed);
    SandboxParams params;
    params.user = user;
    SandboxAttempts attempts;
    attempts.guard = context.guard;
    attempts.file = secret;
    attempts.process = ::getpid();
    auto checked = co_await check_user(processes, clock, params, context.simulator, instance, attempts);
    fs::remove_all(instance, failed);
    fs::remove(secret, failed);
    co_return checked;
}

} // namespace

asio::awaitable<result<SimulationUser>> choose_simulation_user(SimulationConfig const& config,
                                                               SandboxContext context, ProcessHost& processes,
                                                               Clock& clock, Logger log)
{
    if (config.docker)
        co_return SimulationUser();
    auto user = choose(config, context);
    result<> works;
    if (!user)
        works = user.error();
    else if (user->is_other())
        works = co_await check(*user, context, processes, clock);
    if (!works && works.error().code() == asio::error::operation_aborted)
        co_return works.error();
    if (!works && config.simulation_user != "auto")
        co_return Failure(errc::start_failed, concat("\"simulationUser\": \"", config.simulation_user,
                                                     "\" does not work here: ", works.error().message(),
                                                     " (docs/sandboxes.md, \"Another user\")"));
    if (!works) {
        log.warning(concat("No other user can be had for simulations, and they run as root: ",
                           works.error().message(), " (docs/sandboxes.md, \"Another user\")."));
        co_return SimulationUser();
    }
    co_return std::move(*user);
}

void tell_user(SimulationUser const& user, Logger const& log)
{
    if (user.kind == SimulationUser::Kind::one)
        log.info(concat("Simulations run as the user ", user.name, "."));
    if (user.kind == SimulationUser::Kind::of_its_own)
        log.info("Simulations run as other users than this server, each with a number of its own.");
}

} // namespace webots_cloud::app
