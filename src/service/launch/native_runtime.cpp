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
    explicit NativeRuntime(SimulationLauncherParams const& params) : params_(params) {}

    asio::awaitable<result<LaunchPlan>> plan(LaunchSpec const& spec, std::uint16_t port) override
    {
        LaunchPlan plan;
        plan.process = process_for(spec, port);
        bool const is_confined = !params_.sandbox.is_none();
        // The firejail of old releases may get no namespaces, and so no folder of displays either.
        bool const has_display =
            !params_.private_display.server.empty() && (is_confined || !plan.process.set_user_id);
        // The log has the command without all that is put around it now.
        if (is_confined || has_display)
            plan.command = in_one_line(plan.process.argv);
        // Each wraps what stands before: the display is around Webots, the sandbox around both, and all of it
        // runs as the user.
        if (has_display)
            give_display(plan.process, params_.private_display);
        if (is_confined)
            confine(plan.process, params_.sandbox, spec.instance, port);
        run_as(plan.process, params_.sandbox, core::own_user_number(params_.sandbox.user, turn_++, port),
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

    SimulationLauncherParams const& params_;
    std::uint64_t turn_ = 0; ///< Of user numbers.
};

ProcessSpec NativeRuntime::process_for(LaunchSpec const& spec, std::uint16_t port) const
{
    ProcessSpec process;
    process.environment = core::simulator_environment(params_.environment,
                                                      params_.config.simulator_environment, params_.display);
    process.directory = spec.world.parent_path();
    process.grace = params_.grace;
    process.limits = params_.limits;
    if (spec.old_command_line) {
        core::OldStream stream;
        stream.picture = core::is_video(spec.mode);
        stream.controller_edit = spec.controller_edit;
        stream.ssl = params_.old_webots_tls;
        stream.multimedia_server = params_.config.multimedia_server;
        stream.multimedia_stream = params_.config.multimedia_stream;
        process.argv = core::old_webots_command(params_.webots, stream, port, spec.world);
        auto const& [sandbox, on] = core::old_webots_sandbox;
        core::set_variable(process.environment, sandbox, on);
        process.set_user_id = true; // the sandbox is a set-user-ID program
    } else {
        process.argv =
            core::webots_command(params_.webots, spec.mode, port, spec.world, spec.names_extern_robots);
    }
    return process;
}

ProcessSpec NativeRuntime::compiler(LaunchPlan const& plan, std::filesystem::path const& instance,
                                    ControllerSources const& sources)
{
    ProcessSpec process;
    process.argv = core::compile_command(params_.compiler.make, params_.compiler.home, sources.folder,
                                         sources.has_makefile);
    process.environment =
        core::simulator_environment(params_.environment, params_.config.simulator_environment, {});
    process.directory = sources.folder;
    process.grace = Duration::zero(); // it has nothing to save
    process.limits = params_.limits;
    if (!params_.sandbox.is_none()) {
        auto sandbox = params_.sandbox;
        sandbox.read_only.push_back(params_.compiler.home);
        confine(process, sandbox, instance, 0);
        // A compiler fetches nothing, so no network is made for it.
        if (process.network.reach == ProcessNetwork::Reach::internet)
            process.network.reach = ProcessNetwork::Reach::none;
    }
    for (auto const& [name, value] : core::compile_variables(params_.compiler.home))
        core::set_variable(process.environment, name, value);
    // It writes into the folder of the simulation, which is that user's.
    if (plan.process.user)
        run_beside(process, params_.sandbox, *plan.process.user, instance);
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

std::unique_ptr<SimulatorRuntime> make_native_runtime(SimulationLauncherParams const& params)
{
    return std::make_unique<NativeRuntime>(params);
}

} // namespace webots_cloud
