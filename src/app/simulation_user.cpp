// Finds a user for simulations: root takes one of the machine or numbers that nobody has; others need users
// of systemd's unit or of /etc/subuid. A user counts only when a trial under the guard has shown that it
// reaches Webots, and neither a file nor a process of the server. The choice itself is
// core/sandbox/simulation_user.
#include "simulation_user.hpp"

#include "adapters/host/accounts.hpp"
#include "core/sandbox/simulation_user.hpp"
#include "core/sandbox/subordinate_range.hpp"
#include "core/text.hpp"
#include "display.hpp"
#include "environment.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <boost/asio/error.hpp>

#include <sys/prctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <utility>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using core::concat;

constexpr std::string_view see = " (docs/sandboxes.md, \"Another user\")";

constexpr std::array folders_of_checks{"user-check", "sandbox-check"};

/// A graphics processor that we may use, but users without our groups may not; empty: there is none.
fs::path closed_graphics_device()
{
    std::error_code failed;
    std::vector<fs::path> devices{"/dev/nvidiactl", "/dev/nvidia0"};
    for (auto const& device : fs::directory_iterator("/dev/dri", failed))
        devices.push_back(device.path());
    for (auto const& device : devices) {
        struct stat status;
        constexpr mode_t everybody = S_IROTH | S_IWOTH;
        if (::stat(device.c_str(), &status) == 0 && S_ISCHR(status.st_mode) &&
            (status.st_mode & everybody) != everybody && ::access(device.c_str(), R_OK | W_OK) == 0)
            return device;
    }
    return {};
}

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

/// What simulators have to reach.
std::vector<fs::path> visible_for(SandboxContext const& context)
{
    std::vector<fs::path> visible{context.simulator.parent_path(), context.guard};
    std::error_code failed;
    auto const real = fs::weakly_canonical(context.simulator, failed).parent_path();
    if (!failed && real != visible.front())
        visible.push_back(real);
    return visible;
}

result<SimulationUser> choose(SimulationConfig const& config, SandboxContext const& context)
{
    core::SimulationUserContext facts;
    facts.configured = config.simulation_user;
    facts.server = ::geteuid();
    facts.capabilities = our_capabilities();
    auto const name =
        config.simulation_user == "auto" ? std::string(core::usual_simulation_user) : config.simulation_user;
    if (auto const account = adapters::find_account(name)) {
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
    user->visible = visible_for(context);
    return user;
}

/// A file that is not there has no lines.
std::string read_if_there(fs::path const& path)
{
    constexpr std::size_t limit = 1 << 20;
    auto text = read_regular_file(path, limit);
    return text ? std::move(*text) : std::string();
}

/// Where the unit of a service has users made; empty: we are no service of systemd's.
fs::path pinned_users()
{
    auto const runtime = fs::path(environment("RUNTIME_DIRECTORY"));
    return runtime.is_absolute() ? fs::path(runtime.native() + ".users") : fs::path();
}

/// The users that root has made for this service, or else those that `/etc/subuid` gives us.
asio::awaitable<result<std::shared_ptr<adapters::SubordinateUsers>>> open_subordinate_users(fs::path guard)
{
    core::SubordinateContext context;
    context.pinned = pinned_users();
    if (!context.pinned.empty()) {
        auto opened = adapters::open_pinned_users(guard, context.pinned);
        if (opened || !(opened.error() == errc::not_found))
            co_return opened;
    }
    context.no_new_privs = ::prctl(PR_GET_NO_NEW_PRIVS, 0, 0, 0, 0) == 1;
    auto const name = adapters::find_user_name(::geteuid());
    auto const lines_of_users = read_if_there("/etc/subuid");
    auto const lines_of_groups = read_if_there("/etc/subgid");
    context.user = ::geteuid();
    context.name = name;
    context.users = lines_of_users;
    context.groups = lines_of_groups;
    context.newuidmap = find_system_program("newuidmap");
    context.newgidmap = find_system_program("newgidmap");
    auto range = core::find_subordinate_range(context);
    if (!range)
        co_return range.error();
    co_return co_await adapters::make_subordinate_users(std::move(guard), std::move(*range));
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

/// Users of the unit or of `/etc/subuid`, if they work.
asio::awaitable<result<ChosenUser>> choose_subordinate(SandboxContext const& context, ProcessHost& processes,
                                                       Clock& clock)
{
    auto opened = co_await open_subordinate_users(context.guard);
    if (!opened)
        co_return opened.error();
    if (auto const device = closed_graphics_device(); !device.empty())
        co_return Failure(errc::unavailable,
                          concat("they could not use the graphics processor ", device.native(),
                                 ", which only some groups may; let everybody use it (mode 0666)"));
    ChosenUser chosen;
    chosen.subordinate = std::move(*opened);
    std::error_code failed;
    for (auto const* const name : folders_of_checks) // of a guard that was killed at it
        if (auto const folder = context.state / name; fs::exists(folder, failed))
            (void)co_await chosen.subordinate->take_back(folder); // where that fails, so will the check
    chosen.user.kind = SimulationUser::Kind::of_its_own;
    chosen.user.name = "simulation";
    chosen.user.user_namespace = chosen.subordinate->user_namespace();
    chosen.user.numbers = chosen.subordinate->count();
    chosen.user.visible = visible_for(context);
    auto const works = co_await check(chosen.user, context, processes, clock);
    if (!works)
        co_return works.error();
    co_return chosen;
}

/// What the key asks for where the server is not root, and no user is named.
asio::awaitable<result<ChosenUser>> choose_for_others_than_root(SimulationConfig const& config,
                                                                SandboxContext const& context,
                                                                ProcessHost& processes, Clock& clock)
{
    auto chosen = co_await choose_subordinate(context, processes, clock);
    auto const display = wanted_display(config);
    if (chosen && config.simulation_user == "auto" && display.kind == core::DisplayChoice::Kind::shared &&
        !display.name.empty() && x_authority().empty())
        chosen = Failure(errc::unavailable,
                         concat("the display ", core::printable(display.name, 100),
                                " has no password (XAUTHORITY) that they could be given; it may admit this "
                                "server's user alone, other than \"display\": \"private\""));
    if (chosen || chosen.error().code() == asio::error::operation_aborted)
        co_return chosen;
    auto const why = chosen.error().message();
    if (config.simulation_user != "auto")
        co_return Failure(errc::start_failed, concat("\"simulationUser\": \"", config.simulation_user,
                                                     "\" does not work here: ", why, see));
    ChosenUser own;
    own.problem = why;
    co_return own;
}

} // namespace

asio::awaitable<result<ChosenUser>> choose_simulation_user(SimulationConfig const& config,
                                                           SandboxContext context, ProcessHost& processes,
                                                           Clock& clock, Remarks& remarks)
{
    ChosenUser chosen;
    chosen.is_elsewhere = config.docker || config.slurm.has_value(); // jobs are this server's user's
    if (chosen.is_elsewhere)
        co_return chosen;
    bool const is_root = ::geteuid() == 0;
    if (config.simulation_user == "subordinate" && is_root)
        co_return Failure(
            errc::start_failed,
            concat("\"simulationUser\": \"subordinate\" is for servers that are not root; root's "
                   "simulations are other users with \"auto\"",
                   see));
    if (config.simulation_user == "subordinate" || (config.simulation_user == "auto" && !is_root))
        co_return co_await choose_for_others_than_root(config, context, processes, clock);
    auto user = choose(config, context);
    result<> works;
    if (!user)
        works = user.error();
    else if (user->is_other())
        works = co_await check(*user, context, processes, clock);
    if (!works && works.error().code() == asio::error::operation_aborted)
        co_return works.error();
    if (!works && config.simulation_user != "auto")
        co_return Failure(errc::start_failed,
                          concat("\"simulationUser\": \"", config.simulation_user,
                                 "\" does not work here: ", works.error().message(), see));
    if (!works) {
        remarks.warn(concat("No other user can be had for simulations, and they run as root: ",
                            works.error().message(), see, "."));
        chosen.problem = works.error().message();
        co_return chosen;
    }
    chosen.user = std::move(*user);
    co_return chosen;
}

asio::awaitable<void> remove_left_overs(adapters::InstanceRoot& root,
                                        std::shared_ptr<adapters::SubordinateUsers> subordinate,
                                        fs::path guard, Logger log)
{
    if (root.left_overs().kept == 0)
        co_return;
    if (!subordinate && ::geteuid() != 0)
        if (auto opened = co_await open_subordinate_users(std::move(guard)))
            subordinate = std::move(*opened);
    std::error_code failed;
    std::vector<fs::path> folders;
    for (auto const& entry : fs::directory_iterator(root.path(), failed))
        if (entry.symlink_status(failed).type() == fs::file_type::directory)
            folders.push_back(entry.path());
    for (auto const& folder : folders)
        if (subordinate)
            (void)co_await subordinate->take_back(folder); // where that fails, so does the next
    auto const before = root.left_overs().removed;
    root.remove_left_overs();
    if (auto const removed = root.left_overs().removed - before; removed > 0)
        log.info(
            concat("Removed ", std::to_string(removed), " left-over instance directories of other users"));
    if (auto const kept = root.left_overs().kept; kept > 0)
        log.warning(concat(std::to_string(kept), " left-over instance directories can't be removed: remove ",
                           root.path().string(), "/left-over-* by hand."));
}

std::string describe_user(ChosenUser const& chosen, SimulationUser const& user)
{
    if (user.kind == SimulationUser::Kind::of_its_own)
        return "another user for each simulation";
    if (user.kind == SimulationUser::Kind::one)
        return concat("the user ", user.name);
    auto const own = ::geteuid() == 0 ? "root" : "the server's own user";
    return chosen.problem.empty() ? own : concat(own, " (for others: ", chosen.problem, ")");
}

std::string_view shared_user_risk(ChosenUser const& chosen, SimulationUser const& user)
{
    return chosen.is_elsewhere ? std::string_view() : core::shared_user_risk(user);
}

void remark_on_user(ChosenUser const& chosen, SimulationUser const& user, Remarks& remarks)
{
    if (auto const risk = shared_user_risk(chosen, user); !risk.empty()) {
        auto const own = ::geteuid() == 0 ? "root" : "this server's own user";
        auto const why = chosen.problem.empty() ? "" : concat(". For other users: ", chosen.problem, see);
        remarks.warn(concat("Simulations run as ", own, why, ". Each of them ", risk));
    }
    if (user.kind == SimulationUser::Kind::one)
        remarks.note(concat("Simulations run as the user ", user.name, "."));
    if (user.kind == SimulationUser::Kind::of_its_own)
        remarks.note("Simulations run as other users than this server, each with a number of its own.");
}

} // namespace webots_cloud::app
