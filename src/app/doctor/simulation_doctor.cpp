// What the doctor of a simulation server looks at besides checks.cpp: simulator, graphics, Docker, Slurm,
// forges, and by machine_trial what the start of the server tries. A server that runs is asked for what it
// has found at its start; it tries nothing again, since it is confined by then.
#include "aside.hpp"
#include "doctors.hpp"
#include "service_view.hpp"
#include "start_trial.hpp"

#include "adapters/http_client/web_probe.hpp"
#include "adapters/projects/instance_root.hpp"
#include "app/daemon.hpp"
#include "app/environment.hpp"
#include "app/machine_trial.hpp"
#include "app/own_limits.hpp"
#include "app/simulation_folders.hpp"
#include "app/simulation_machine.hpp"
#include "core/doctor/network_findings.hpp"
#include "core/doctor/simulation_findings.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/http_client.hpp>
#include <webots_cloud/adapters/names.hpp>
#include <webots_cloud/adapters/processes.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <unistd.h>

#include <filesystem>
#include <memory>

namespace webots_cloud::app {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;
using core::Findings;
using core::Verdict;

constexpr std::uint64_t gigabyte = std::uint64_t{1} << 30;
constexpr std::uint64_t other_files = 1024; // descriptors, of browsers among others
constexpr std::size_t max_version_file = 4096;

std::uint64_t wanted_memory(SimulationConfig const& config)
{
    return config.fetch_memory + gigabyte;
}

/// A folder for files of the checks, which ends with them.
class TemporaryFolder
{
public:
    TemporaryFolder()
    {
        auto name = (temporary_folder() / "webots-doctor-XXXXXX").string();
        if (::mkdtemp(name.data()))
            path_ = name;
        std::error_code failed; // simulations of other users have to get to theirs in it
        fs::permissions(path_, fs::perms::owner_all | fs::perms::group_exec | fs::perms::others_exec, failed);
    }
    TemporaryFolder(TemporaryFolder const&) = delete;
    ~TemporaryFolder()
    {
        std::error_code failed;
        if (!path_.empty())
            fs::remove_all(path_, failed);
    }

    fs::path const& path() const { return path_; } ///< Empty: there is none.

private:
    fs::path path_;
};

core::Finding simulator_finding(result<core::SimulatorChoice> const& choice)
{
    if (!choice)
        return core::judge_simulator(choice.error());
    core::SimulatorReading reading;
    reading.program = choice->program;
    reading.is_webots = choice->notice.empty();
    auto const text =
        read_regular_file(choice->program.parent_path() / "resources" / "version.txt", max_version_file);
    if (text)
        reading.version_text = *text;
    return core::judge_simulator(reading);
}

core::Finding graphics_finding()
{
    core::GraphicsReading reading;
    std::error_code failed;
    std::vector<fs::path> devices;
    for (auto const& entry : fs::directory_iterator("/dev/dri", failed))
        if (entry.path().filename().native().starts_with("renderD"))
            devices.push_back(entry.path());
    for (fs::path const device : {"/dev/nvidia0", "/dev/nvidia1"})
        if (fs::exists(device, failed))
            devices.push_back(device);
    for (auto const& device : devices)
        (::access(device.c_str(), R_OK | W_OK) == 0 ? reading.devices : reading.closed)
            .push_back(device.string());
    return core::judge_graphics(reading);
}

/// There is no room to try anything in, or nothing to try it with.
Findings untried(std::string_view found, std::string_view remedy)
{
    return {core::Finding(Verdict::fault, "sandbox", found, remedy)};
}

/// Tries what the start of the server tries, and then what a visitor's start does.
CheckWork check_machine(SimulationConfig config, fs::path programs, core::SimulatorChoice simulator,
                        Clock& clock)
{
    TemporaryFolder const folder;
    auto root = adapters::InstanceRoot::open(folder.path() / "state", "0");
    if (folder.path().empty() || !root)
        co_return untried("there is no room for temporary files",
                          "No simulation starts without it: make room.");
    SimulationMachine machine(std::move(simulator), std::move(*root));
    machine.guard = programs / "webots-process-guard";
    machine.cache = folder.path() / "cache";
    if (!is_program(machine.guard))
        co_return untried(concat("there is no program ", machine.guard.string()),
                          "No simulation starts without it: install it with the server.");
    TrialContext context;
    context.guard = machine.guard;
    context.simulator = machine.simulator.program;
    context.state = machine.instances().parent_path();
    machine.processes = make_process_host(co_await asio::this_coro::executor, machine.guard);
    machine.trial = co_await try_machine(config, std::move(context), *machine.processes, clock);
    auto findings = machine.trial.findings;
    // A job could wait for hours for a node.
    if (!machine.trial.outcome || machine.simulator.program.empty() || config.slurm)
        co_return findings;
    auto const started = co_await try_start(config, machine, folder.path(), clock);
    findings.push_back(started);
    co_return findings;
}

/// Webots draws with OpenGL. What computes that is seen with the program of mesa-utils, and on a screen that
/// all simulations share: displays of their own are drawn by the processor anyway.
CheckWork check_renderer(std::string display)
{
    Findings findings;
    std::vector<std::string> command{"glxinfo", "-display", std::move(display), "-B"};
    auto const printed = co_await output_of(std::move(command));
    if (printed || !(printed.error() == errc::not_found))
        findings.push_back(core::judge_renderer(printed));
    co_return findings;
}

/// The screen that all simulations draw on; empty: there is none, or each has its own.
std::string shared_display(SimulationConfig const& config)
{
    auto const name = config.display.empty() ? environment("DISPLAY") : config.display;
    return config.docker || config.slurm || name == "private" || name == "none" ? std::string() : name;
}

CheckWork check_docker()
{
    std::vector<std::string> command{"docker", "version", "--format", "{{.Server.Version}}"};
    auto const version = co_await output_of(std::move(command));
    Findings findings{core::judge_docker(version)};
    co_return findings;
}

CheckWork check_slurm(fs::path state)
{
    std::vector<std::string> command{"sinfo", "--noheader", "--format=%P"};
    auto const partitions = co_await output_of(std::move(command));
    Findings findings{core::judge_slurm(partitions, state.native())};
    co_return findings;
}

using Judge = core::Finding (*)(std::string_view url, result<int> const& answer);

CheckWork check_web_server(std::string url, Judge judge)
{
    std::function<result<int>()> const look = [url] { return adapters::try_web_server(url, answer_limit); };
    auto const answer = co_await aside<int>(look);
    Findings findings{judge(url, answer)};
    co_return findings;
}

} // namespace

Findings simulator_findings(SimulationConfig const& config, result<core::SimulatorChoice> const& choice)
{
    if (config.docker)
        return {};
    return {simulator_finding(choice), graphics_finding()};
}

CheckWork examine_simulation_server(SimulationConfig config, fs::path programs, Findings walls,
                                    Viewpoint viewpoint, asio::any_io_executor executor, Progress progress)
{
    auto const clock = make_steady_clock(executor);
    auto const http = make_http_client(executor);
    auto findings = port_findings(config.address.port, config.network, viewpoint.is_running);
    if (!viewpoint.is_running)
        for (auto& each : simulation_port_findings(config))
            findings.push_back(std::move(each));
    if (!viewpoint.is_server) // whose event loop must not wait for a drive
        for (auto& each : website_findings(config))
            findings.push_back(std::move(each));
    for (auto& each : machine_findings(wanted_memory(config),
                                       descriptors_per_simulation *
                                               static_cast<std::uint64_t>(config.launching.max_simulations) +
                                           other_files))
        findings.push_back(std::move(each));
    findings.insert(findings.end(), walls.begin(), walls.end());
    // A server that looks at itself starts no programs: it is confined by then, and `walls` has what it found
    // at its start.
    std::vector<Check> checks;
    if (auto display = shared_display(config); !viewpoint.is_server && !display.empty())
        checks.emplace_back("renderer", check_renderer(std::move(display)));
    if (!viewpoint.is_server && config.docker)
        checks.emplace_back("docker", check_docker());
    if (!viewpoint.is_server && config.slurm) {
        auto const& copies = config.slurm->copy_to;
        checks.emplace_back("slurm",
                            check_slurm(copies.empty() ? state_folders(config).front().path : copies));
    }
    if (!viewpoint.is_server && !config.docker) {
        auto const choice = find_simulator(config, programs);
        checks.emplace_back(
            "sandbox", check_machine(config, programs, choice ? *choice : core::SimulatorChoice(), *clock),
            trial_limit + empty_start_limit);
    }
    auto const names = make_name_service(executor);
    for (auto& each : common_checks(folders_of(config), log_file_of(config), config.network, config.address,
                                    viewpoint, *http, *names))
        checks.push_back(std::move(each));
    for (auto const& forge : config.forges)
        if (forge.is_server()) // whoever reads the configuration looks for folders
            checks.emplace_back(concat("forge ", forge.url), check_web_server(forge.url, core::judge_forge));
    for (auto const& registry : config.service.notify)
        checks.emplace_back(concat("registry ", registry), check_web_server(registry, core::judge_registry));
    auto more = co_await examine(std::move(checks), *clock, std::move(progress));
    findings.insert(findings.end(), more.begin(), more.end());
    co_return findings;
}

Findings diagnose_simulation_server(Arguments const& arguments, fs::path const& programs, Progress progress)
{
    Findings findings;
    auto const config = read_for_doctor<SimulationConfig>(arguments, parse_simulation_config, findings);
    if (!config || !can_wait(findings))
        return findings;
    auto const port = config->address.port;
    auto const viewpoint = view_from_outside("simulation", port, config->access);
    auto seen = view_of_service("simulation", arguments, viewpoint.socket);
    asio::io_context context;
    if (seen.is_complete) {
        run_to_end(findings_of_root(wanted_memory(*config), port), context, seen.findings);
        return seen.findings;
    }
    findings.insert(findings.begin(), seen.findings.begin(), seen.findings.end());
    auto const absolute = absolute_path(programs);
    auto const simulator = simulator_findings(*config, find_simulator(*config, absolute));
    run_to_end(examine_simulation_server(*config, absolute, simulator, viewpoint, context.get_executor(),
                                         std::move(progress)),
               context, findings);
    return findings;
}

} // namespace webots_cloud::app
