// Decisions: core/simulation/launch_plan, core/simulation/controller_compiler.
#include "core/sandbox/simulation_user.hpp"
#include "core/simulation/controller_compiler.hpp"
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "service/sandbox/confine.hpp"
#include "service/sandbox/run_as.hpp"
#include "simulator_runtime.hpp"

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

/// Programs of this machine: Webots itself, in what was found to keep it apart.
class NativeRuntime final : public SimulatorRuntime
{
public:
    NativeRuntime(SimulationLauncherConfig const& config, SimulationLauncherFacts const& facts)
        : config_(config), facts_(facts)
    {}

    asio::awaitable<result<LaunchPlan>> plan(LaunchSpec const& spec, std::uint16_t port) override
    {
        LaunchPlan plan;
        plan.process = process_for(spec, port);
        bool const is_confined = !facts_.sandbox.is_none();
        // The firejail of old releases may get no namespaces, and so no folder of displays either.
        bool const has_display =
            !facts_.private_display.server.empty() && (is_confined || !plan.process.set_user_id);
        // The log has the command without all that is put around it now.
        if (is_confined || has_display)
            plan.command = in_one_line(plan.process.argv);
        // Each wraps what stands before: the display is around Webots, the sandbox around both, and all of it
        // runs as the user.
        if (has_display)
            give_display(plan.process, facts_.private_display);
        if (is_confined)
            confine(plan.process, facts_.sandbox, spec.instance, port);
        run_as(plan.process, facts_.sandbox, core::own_user_number(facts_.sandbox.user, turn_++, port),
               spec.instance);
        co_return plan;
    }

    ProcessSpec compiler(LaunchPlan const& plan, std::filesystem::path const& instance,
                         ControllerSources const& sources) override;

    void forget(LaunchPlan const&) noexcept override {}

    /// The guard exits only when nothing is left.
    bool leaves_something() const noexcept override { return false; }

    asio::awaitable<void> clear(LaunchPlan const&) override { co_return; }

    PrintedLine read(std::string_view line, LaunchPlan const&) override
    {
        PrintedLine printed;
        printed.line = core::ComposeLine(core::ComposeLine::Source::webots, line);
        return printed;
    }

    /// Webots takes another port when some other program has taken its port meanwhile.
    bool keeps_its_port() const noexcept override { return false; }

private:
    ProcessSpec process_for(LaunchSpec const& spec, std::uint16_t port) const;

    SimulationLauncherConfig const& config_;
    SimulationLauncherFacts const& facts_;
    std::uint64_t turn_ = 0; ///< Of user numbers.
};

ProcessSpec NativeRuntime::process_for(LaunchSpec const& spec, std::uint16_t port) const
{
    ProcessSpec process;
    process.environment =
        core::simulator_environment(facts_.environment, config_.simulator_environment, facts_.display);
    process.directory = spec.world.parent_path();
    process.grace = config_.grace;
    process.limits = facts_.limits;
    if (spec.old_command_line) {
        core::OldStream stream;
        stream.picture = core::is_video(spec.mode);
        stream.controller_edit = spec.controller_edit;
        stream.ssl = facts_.old_webots_tls;
        stream.multimedia_server = config_.multimedia_server;
        stream.multimedia_stream = config_.multimedia_stream;
        process.argv = core::old_webots_command(facts_.webots, stream, port, spec.world);
        auto const& [sandbox, on] = core::old_webots_sandbox;
        core::set_variable(process.environment, sandbox, on);
        process.set_user_id = true; // the sandbox is a set-user-ID program
    } else {
        process.argv =
            core::webots_command(facts_.webots, spec.mode, port, spec.world, spec.names_extern_robots);
    }
    return process;
}

ProcessSpec NativeRuntime::compiler(LaunchPlan const& plan, std::filesystem::path const& instance,
                                    ControllerSources const& sources)
{
    ProcessSpec process;
    process.argv = core::compile_command(facts_.compiler.make, facts_.compiler.home, sources.folder,
                                         sources.has_makefile);
    process.environment = core::simulator_environment(facts_.environment, config_.simulator_environment, {});
    process.directory = sources.folder;
    process.grace = Duration::zero(); // it has nothing to save
    process.limits = facts_.limits;
    if (!facts_.sandbox.is_none()) {
        auto sandbox = facts_.sandbox;
        sandbox.read_only.push_back(facts_.compiler.home);
        confine(process, sandbox, instance, 0);
        // A compiler fetches nothing, so no network is made for it.
        if (process.network.reach == ProcessNetwork::Reach::internet)
            process.network.reach = ProcessNetwork::Reach::none;
    }
    for (auto const& [name, value] : core::compile_variables(facts_.compiler.home))
        core::set_variable(process.environment, name, value);
    // It writes into the folder of the simulation, which is that user's.
    if (plan.process.user)
        run_beside(process, facts_.sandbox, *plan.process.user, instance);
    return process;
}

} // namespace

std::string in_one_line(std::vector<std::string> const& argv)
{
    std::string line;
    for (auto const& word : argv)
        line.append(line.empty() ? "" : " ").append(word);
    return line;
}

std::unique_ptr<SimulatorRuntime> make_native_runtime(SimulationLauncherConfig const& config,
                                                      SimulationLauncherFacts const& facts)
{
    return std::make_unique<NativeRuntime>(config, facts);
}

} // namespace webots_cloud
