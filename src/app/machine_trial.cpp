// Each part is tried once. What it came to is kept in two forms: remarks, sentences in the order in which
// they were found out, and findings, one for each part, which core/doctor judges.
#include "machine_trial.hpp"

#include "adapters/process/guard_probe.hpp"
#include "core/doctor/simulation_findings.hpp"
#include "core/sandbox/limits.hpp"
#include "core/simulation/isolation.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/processes.hpp>

#include <boost/asio/error.hpp>

#include <unistd.h>

#include <utility>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using core::concat;

core::Finding finding_of(std::string_view subject, std::string_view key, std::string description,
                         std::vector<std::string> warnings)
{
    core::AttemptReading reading;
    reading.description = std::move(description);
    reading.warnings = std::move(warnings);
    return core::judge_attempt(subject, key, reading);
}

/// Only once the sandbox is known, which another user may not be able to make: then simulations run as ours.
void judge_user(MachineTrial& trial, SimulationUser const& user, Remarks const& remarks)
{
    auto warnings = remarks.warnings();
    if (auto const risk = shared_user_risk(trial.user, user); !risk.empty())
        warnings.push_back(concat("each of them ", risk));
    trial.findings.push_back(finding_of("user", "\"simulationUser\"",
                                        concat("simulations run as ", describe_user(trial.user, user)),
                                        std::move(warnings)));
}

/// The user, the sandbox and the display.   Errors: as of `MachineTrial::outcome`.
asio::awaitable<result<>> try_walls(SimulationConfig const& config, TrialContext const& context,
                                    ProcessHost& processes, Clock& clock, MachineTrial& trial)
{
    SandboxContext about;
    about.simulator = context.simulator;
    about.guard = context.guard;
    about.state = context.state;
    // Each is tried in what was chosen before it: the sandbox as the user, the display in the sandbox. So
    // whatever fails ends the trial.
    Remarks on_user;
    auto user = co_await choose_simulation_user(config, about, processes, clock, on_user);
    if (!user) {
        trial.findings.push_back(core::judge_attempt("user", "\"simulationUser\"", user.error()));
        co_return user.error();
    }
    trial.user = std::move(*user);
    about.user = trial.user.user;
    trial.remarks.add(on_user);

    Remarks on_sandbox;
    auto sandbox = co_await choose_sandbox(config, about, processes, clock, on_sandbox);
    judge_user(trial, sandbox ? sandbox->params.user : about.user, on_user);
    if (!sandbox) {
        trial.findings.push_back(core::judge_attempt("sandbox", "\"sandbox\"", sandbox.error()));
        co_return sandbox.error();
    }
    trial.sandbox = std::move(*sandbox);
    trial.remarks.add(on_sandbox);
    remark_on_user(trial.user, trial.sandbox.params.user, trial.remarks);
    trial.findings.push_back(
        finding_of("sandbox", "\"sandbox\"", trial.sandbox.description, on_sandbox.warnings()));

    Remarks on_display;
    auto display = co_await choose_display(config, trial.sandbox.params, context.guard, context.state,
                                           processes, clock, on_display);
    if (!display) {
        trial.findings.push_back(core::judge_attempt("display", "\"display\"", display.error()));
        co_return display.error();
    }
    trial.display = std::move(*display);
    trial.remarks.add(on_display);
    trial.findings.push_back(
        finding_of("display", "\"display\"", trial.display.description, on_display.warnings()));
    co_return result<>();
}

/// What the guard can do here.
asio::awaitable<void> try_isolation(TrialContext const& context, Clock& clock, MachineTrial& trial)
{
    constexpr std::string_view subject = "processes";
    constexpr std::string_view key = "the kernel's settings";
    auto const answer = co_await adapters::probe_guard(context.guard, context.read_only, clock);
    auto const parsed = answer ? core::parse_isolation(*answer) : result<core::Isolation>(answer.error());
    core::Isolation isolation;
    if (parsed)
        isolation = *parsed;
    else
        isolation.reason = parsed.error().message();
    trial.isolation_warning = core::isolation_warning(isolation);
    if (!trial.isolation_warning.empty())
        trial.remarks.warn(trial.isolation_warning);
    bool const runs_as_root = ::geteuid() == 0 && !trial.sandbox.params.user.is_other();
    for (auto& remark : core::isolation_remarks(isolation, runs_as_root))
        trial.remarks.warn(std::move(remark));
    if (!parsed)
        trial.findings.push_back(core::judge_attempt(subject, key, parsed.error()));
    else if (trial.isolation_warning.empty())
        trial.findings.push_back(finding_of(subject, key, "simulations are kept apart", {}));
    else
        trial.findings.push_back(
            finding_of(subject, key, "simulations are not kept apart", {trial.isolation_warning}));
}

/// Which limits simulations have, and which are not kept well. Jobs of a cluster have those of their nodes.
void judge_limits(SimulationConfig const& config, TrialContext const& context, MachineTrial& trial)
{
    core::CountedMemory counted;
    counted.private_folders = !trial.sandbox.walls.sandbox.empty();
    counted.open_files =
        ::geteuid() == 0 || trial.sandbox.params.user.kind != SimulationUser::Kind::of_its_own;
    if (config.slurm) {
        trial.unkept_limits = core::unkept_job_limits(context.limits);
    } else {
        trial.remarks.note(core::limits_text(context.limits, *context.limit_support));
        trial.unkept_limits = core::unkept_limits(context.limits, *context.limit_support, counted);
    }
    if (trial.unkept_limits.empty())
        return;
    trial.remarks.warn(trial.unkept_limits);
    trial.findings.push_back(core::judge_limits(trial.unkept_limits));
}

} // namespace

asio::awaitable<MachineTrial> try_machine(SimulationConfig const& config, TrialContext context,
                                          ProcessHost& processes, Clock& clock)
{
    MachineTrial trial;
    trial.user.is_elsewhere = config.docker;
    if (config.docker) {
        trial.walls.containers = true;
        trial.walls.limits = true; // Docker keeps them
        trial.container_network = choose_container_network(config, context.state, trial.remarks);
        trial.sandbox.description = trial.container_network.description;
        co_return trial;
    }
    if (!context.simulator.empty())
        trial.outcome = co_await try_walls(config, context, processes, clock, trial);
    if (!trial.outcome && trial.outcome.error().code() == asio::error::operation_aborted)
        co_return trial;
    co_await try_isolation(context, clock, trial);
    if (context.limit_support)
        judge_limits(config, context, trial);
    trial.walls = trial.sandbox.walls;
    trial.walls.own_displays = trial.display.name.empty();
    trial.walls.limits =
        !config.slurm && context.limit_support && core::limits_hold(context.limits, *context.limit_support);
    co_return trial;
}

std::string walls_warning(MachineTrial const& trial)
{
    std::vector<std::string> sentences{trial.isolation_warning, trial.sandbox.warning};
    bool const wants_another = !trial.user.problem.empty() || trial.user.user.is_other();
    if (::geteuid() == 0 && wants_another && !trial.sandbox.params.user.is_other())
        sentences.push_back(concat("Simulations run as root, since no other user can be had",
                                   trial.user.problem.empty() ? "" : ": ", trial.user.problem,
                                   " (docs/sandboxes.md, \"Another user\")."));
    std::erase(sentences, std::string());
    std::string text;
    for (auto const& sentence : sentences)
        text += concat(text.empty() ? "" : " ", sentence);
    return text;
}

std::string describe_confinement(MachineTrial const& trial)
{
    auto text = trial.sandbox.description;
    if (!trial.user.is_elsewhere)
        text.append(concat("; ", describe_user(trial.user, trial.sandbox.params.user)));
    return text;
}

} // namespace webots_cloud::app
