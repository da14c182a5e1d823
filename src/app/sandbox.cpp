// Assembles the parameters of bubblewrap or firejail from what is installed here, and tries whether the
// sandbox holds before it counts: a program in it attempts what it must not be able to do (guard/attempts).
// What a sandbox shows of the machine is decided in core/sandbox.
#include "sandbox.hpp"

#include "core/sandbox/firejail.hpp"
#include "core/sandbox/network_rules.hpp"
#include "core/sandbox/visible.hpp"
#include "core/text.hpp"
#include "environment.hpp"

#include <webots_cloud/adapters/host.hpp>

#include <boost/asio/error.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/this_coro.hpp>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <initializer_list>
#include <utility>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using core::concat;
using Reach = ProcessNetwork::Reach;

constexpr std::initializer_list<char const*> graphics_devices = {
    "/dev/dri",     "/dev/nvidiactl", "/dev/nvidia-uvm", "/dev/nvidia-uvm-tools", "/dev/nvidia-modeset",
    "/dev/nvidia0", "/dev/nvidia1",   "/dev/nvidia2",    "/dev/nvidia3",          "/dev/nvidia4",
    "/dev/nvidia5", "/dev/nvidia6",   "/dev/nvidia7"};

result<> write_file(fs::path const& path, std::string_view text)
{
    std::ofstream file(path, std::ios::trunc | std::ios::binary);
    file << text << std::flush;
    if (!file)
        return Failure(errc::start_failed, concat(path.string(), " can't be written"));
    return {};
}

std::string describe(Reach reach)
{
    switch (reach) {
    case Reach::host:
        return "network of this machine";
    case Reach::none:
        return "no network";
    case Reach::internet:
        break;
    }
    return "public internet only";
}

result<ProcessNetwork> network_of(SimulationConfig const& config, fs::path const& rules)
{
    ProcessNetwork network;
    network.reach = config.network_reach == "host"   ? Reach::host
                    : config.network_reach == "none" ? Reach::none
                                                     : Reach::internet;
    if (network.reach != Reach::internet)
        return network;
    network.rules = rules;
    for (auto const& [name, path] :
         {std::pair("slirp4netns", &network.slirp), std::pair("ip", &network.ip)}) {
        *path = find_system_program(name);
        if (path->empty())
            return Failure(errc::start_failed,
                           concat(name, " is not installed, without which simulations can't "
                                        "be kept to the public internet"));
    }
    return network;
}

/// What Webots needs besides the system: its own folder, by the name that it is started by and by its own.
std::vector<fs::path> folders_of(fs::path const& simulator)
{
    std::error_code failed;
    std::vector<fs::path> folders{simulator.parent_path()};
    auto const real = fs::weakly_canonical(simulator, failed).parent_path();
    if (!failed && real != folders.front())
        folders.push_back(real);
    std::erase_if(folders, [](fs::path const& folder) { return folder.native().starts_with("/usr/"); });
    return folders;
}

std::string read_small_file(fs::path const& path)
{
    std::array<char, 16 * 1024> buffer;
    std::ifstream file(path, std::ios::binary);
    file.read(buffer.data(), buffer.size());
    return std::string(buffer.data(), static_cast<std::size_t>(file.gcount()));
}

// Bytes of a file of the system. Each simulation gets copies of its own, which take memory.
constexpr std::uintmax_t max_copied = 1 << 20;

/// Who can read what simulations of this user can, where nothing else confines them.
std::string_view who_reads_as(SimulationUser const& user)
{
    return user.is_other() ? "everybody on this machine" : "this server";
}

result<> find_bubblewrap(SandboxParams& sandbox)
{
    sandbox.bubblewrap = find_program("bwrap");
    if (sandbox.bubblewrap.empty())
        return Failure(errc::start_failed, "bubblewrap is not installed");
    std::error_code failed;
    for (fs::path const folder : core::system_folders())
        if (auto const target = fs::read_symlink(folder, failed);
            !failed && target.native().starts_with("usr/"))
            sandbox.system_links.emplace_back(folder, target);
    for (fs::path const file : core::system_files())
        if (fs::is_regular_file(file, failed) && fs::file_size(file, failed) <= max_copied && !failed)
            sandbox.copied.push_back(file);
    return {};
}

/// Writes the profile too.
result<> find_firejail(SandboxParams& sandbox, fs::path const& state)
{
    sandbox.firejail = find_program("firejail");
    if (sandbox.firejail.empty())
        return Failure(errc::start_failed, "firejail is not installed");
    // Its own privileges end where a user namespace begins, and without one others than root can neither give
    // simulations a network of their own nor end what firejail has started.
    if (::geteuid() != 0)
        return Failure(
            errc::start_failed,
            "firejail confines simulations only where the server runs as root; bubblewrap does not "
            "need that");
    std::error_code failed;
    fs::create_directories(core::firejail_files, failed);
    core::FirejailMachine machine;
    for (auto const& entry : fs::directory_iterator("/", failed)) {
        bool const is_folder = !entry.is_symlink(failed) && entry.is_directory(failed);
        (is_folder ? machine.folders : machine.files).push_back(entry.path());
    }
    std::sort(machine.folders.begin(), machine.folders.end());
    std::sort(machine.files.begin(), machine.files.end());
    if (sandbox.network.reach != Reach::none)
        machine.name_servers = core::name_servers(read_small_file(sandbox.resolver));
    machine.has_graphics = !sandbox.devices.empty();
    sandbox.firejail_profile = state / "firejail.profile";
    return write_file(sandbox.firejail_profile, core::firejail_profile(machine));
}

result<SandboxParams> assemble(std::string_view name, SimulationConfig const& config,
                               SandboxContext const& context)
{
    SandboxParams sandbox;
    auto const rules = context.state / "network.rules";
    auto const network = network_of(config, rules);
    if (!network)
        return network.error();
    sandbox.network = *network;
    // Written also where no network has such rules: `check` has the sandbox try to read this file.
    if (auto const written = write_file(rules, core::internet_only_rules(own_ipv4_addresses())); !written)
        return written.error();
    sandbox.resolver = "/etc/resolv.conf";
    if (sandbox.network.reach == Reach::internet) {
        sandbox.resolver = context.state / "resolv.conf";
        if (auto const written = write_file(sandbox.resolver, core::sandbox_resolver); !written)
            return written.error();
    }
    sandbox.filter = context.guard;
    sandbox.read_only = folders_of(context.simulator);
    std::error_code failed;
    for (fs::path const device : graphics_devices)
        if (fs::exists(device, failed))
            sandbox.devices.push_back(device);
    sandbox.x_authority = x_authority();
    if (name == "bubblewrap") // firejail's own privileges need a user with a name
        sandbox.user = context.user;
    auto const found = name == "firejail" ? find_firejail(sandbox, context.state) : find_bubblewrap(sandbox);
    if (!found)
        return found.error();
    return sandbox;
}

asio::awaitable<result<>> check_once(SandboxParams const& sandbox, SandboxContext const& context,
                                     ProcessHost& processes, Clock& clock)
{
    using asio::ip::tcp;
    boost::system::error_code error;
    // Stands for a service of this machine, which a simulation must not reach.
    tcp::acceptor somebody(co_await asio::this_coro::executor);
    somebody.open(tcp::v4(), error);
    if (!error)
        somebody.bind({asio::ip::address_v4::loopback(), 0}, error);
    if (!error)
        somebody.listen(1, error);
    if (error)
        co_return Failure(error).within("no port to try the sandbox with");
    SandboxAttempts attempts;
    attempts.guard = context.guard;
    attempts.file = context.state / "network.rules";
    // Who shares the machine's network reaches all that listens there: port 0 is nobody's.
    attempts.port =
        sandbox.network.reach == Reach::host ? std::uint16_t{0} : somebody.local_endpoint(error).port();
    attempts.process = ::getpid();
    auto const instance = context.state / "sandbox-check";
    std::error_code failed;
    fs::remove_all(instance, failed); // of a server that has died here
    fs::create_directory(instance, failed);
    auto const checked = co_await check_sandbox(processes, clock, sandbox, instance, attempts);
    fs::remove_all(instance, failed);
    co_return checked;
}

/// Whether it keeps what it promises.
asio::awaitable<result<>> check(std::string_view name, SandboxParams const& sandbox,
                                SandboxContext const& context, ProcessHost& processes, Clock& clock)
{
    auto checked = co_await check_once(sandbox, context, processes, clock);
    // On a busy machine firejail's processes miss each other now and then ("cannot sync with peer").
    bool const may_be_chance =
        !checked && name == "firejail" && checked.error().code() != asio::error::operation_aborted;
    if (may_be_chance)
        checked = co_await check_once(sandbox, context, processes, clock);
    co_return checked;
}

} // namespace

ContainerNetwork choose_container_network(SimulationConfig const& config, fs::path const& state,
                                          Remarks& remarks)
{
    ContainerNetwork chosen;
    chosen.description = "Docker, network of Docker";
    if (config.network_reach == "host")
        return chosen;
    auto const rules = state / "network.rules";
    auto network = network_of(config, rules);
    result<> written;
    if (::geteuid() != 0)
        network =
            Failure(errc::start_failed, "only a server that runs as root can give containers a network");
    else if (network)
        written = write_file(rules, core::internet_only_rules(own_ipv4_addresses()));
    // Without such a network containers have Docker's, as they always had; the operator is told what that
    // means.
    if (!network || !written) {
        remarks.warn(
            concat("Containers reach all that Docker's own networks reach, services of this machine and "
                   "private networks among it: ",
                   (network ? written.error() : network.error()).message(), " (docs/docker.md)."));
        return chosen;
    }
    chosen.network = *network;
    if (network->reach == Reach::internet)
        chosen.name_server = core::name_servers(core::sandbox_resolver).front();
    chosen.description = concat("Docker, ", describe(network->reach));
    return chosen;
}

asio::awaitable<result<ChosenSandbox>> choose_sandbox(SimulationConfig const& config, SandboxContext context,
                                                      ProcessHost& processes, Clock& clock, Remarks& remarks)
{
    ChosenSandbox chosen;
    if (config.docker) {
        chosen.walls.containers = true;
        chosen.description = "Docker";
        co_return chosen;
    }
    if (config.sandbox == "none") {
        remarks.warn(
            concat("Simulations run without a sandbox, as \"sandbox\" says: each of them can read what ",
                   who_reads_as(context.user),
                   " can read, and reach what this server reaches (docs/sandboxes.md)."));
        chosen.description = "none";
        chosen.params.user = context.user;
        chosen.params.x_authority = x_authority(); // another user gets a copy
        co_return chosen;
    }
    std::vector<std::string> names{config.sandbox};
    if (config.sandbox == "auto")
        names = {"bubblewrap", "firejail"}; // bubblewrap shows simulations less of the machine
    std::string reasons;
    for (auto const& name : names) {
        auto assembled = assemble(name, config, context);
        result<> works;
        if (assembled)
            works = co_await check(name, *assembled, context, processes, clock);
        else
            works = assembled.error();
        if (!works && assembled && assembled->user.is_other() && config.simulation_user == "auto") {
            // Where only root may make user namespaces, the sandbox is worth more than the user.
            assembled->user = SimulationUser();
            auto const of_root = co_await check(name, *assembled, context, processes, clock);
            if (of_root)
                remarks.warn(
                    concat("Simulations run as ", ::geteuid() == 0 ? "root" : "this server's own user",
                           " in the sandbox, since another user can't make it: ", works.error().message(),
                           " (docs/sandboxes.md, \"Another user\")."));
            if (of_root)
                works = of_root;
        }
        if (works) {
            chosen.params = std::move(*assembled);
            chosen.walls.sandbox = name;
            chosen.walls.by_name = config.sandbox == name;
            chosen.description = concat(name, ", ", describe(chosen.params.network.reach));
            remarks.note(concat("Simulations run in a sandbox: ", chosen.description, "."));
            if (!reasons.empty())
                remarks.warn(concat("Not in the stronger one: ", reasons, " (docs/sandboxes.md)."));
            co_return chosen;
        }
        // The server is being ended, which says nothing of this sandbox.
        if (works.error().code() == asio::error::operation_aborted)
            co_return works.error();
        reasons.append(concat(reasons.empty() ? "" : "; ", names.size() > 1 ? concat(name, ": ") : "",
                              works.error().message()));
    }
    // An operator who asks for a certain sandbox gets no server without it.
    if (config.sandbox != "auto")
        co_return Failure(errc::start_failed,
                          concat("\"sandbox\": \"", config.sandbox, "\" does not work here: ", reasons,
                                 " (docs/sandboxes.md)"));
    chosen.description = "none";
    chosen.params.user = context.user;
    chosen.params.x_authority = x_authority();
    chosen.warning =
        concat("Simulations run without a sandbox, and can read what ", who_reads_as(context.user),
               " can read, and reach what this server reaches: ", reasons, " (docs/sandboxes.md).");
    remarks.warn(chosen.warning);
    co_return chosen;
}

} // namespace webots_cloud::app
