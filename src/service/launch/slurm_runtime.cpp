// The command line of a native simulator, wrapped into srun and a guard on the node. Where the node does not
// see the project, its paths are those of a copy; job_output.hpp reads what comes back.
// Decisions: core/slurm/job_command, core/simulation/launch_plan.
#include "core/simulation/launch_plan.hpp"
#include "core/simulation/simulator_environment.hpp"
#include "core/slurm/job_command.hpp"
#include "core/text.hpp"
#include "simulator_runtime.hpp"

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

namespace fs = std::filesystem;

/// Where a file of this machine is in the folder of a job.
fs::path there(fs::path const& folder, fs::path const& path)
{
    return folder / path.relative_path();
}

/// What a project is in: the folder of its repository, beside which may be what only this machine needs.
fs::path project_folder(LaunchSpec const& spec)
{
    auto const inside = spec.root.lexically_relative(spec.instance);
    return inside.empty() || *inside.begin() == "." ? spec.instance : spec.instance / *inside.begin();
}

/// A native program, but for the place where it runs.
class SlurmRuntime final : public SimulatorRuntime
{
public:
    SlurmRuntime(SimulationLauncherConfig const& config, SimulationLauncherFacts const& facts,
                 SlurmMode& slurm)
        : config_(config), facts_(facts), slurm_(slurm), native_(make_native_runtime(config, facts))
    {}

    asio::awaitable<result<LaunchPlan>> plan(LaunchSpec const& spec, std::uint16_t port) override
    {
        auto const& copy_to = slurm_.config().copy_to;
        auto const name = slurm_.new_job(spec.label);
        bool const is_copied = !copy_to.empty();
        auto const folder = is_copied ? core::job_folder(copy_to, name) : fs::path();
        // The native command is made with the paths that the node will see.
        auto seen = spec;
        for (auto* path : {&seen.instance, &seen.root, &seen.world})
            *path = is_copied ? there(folder, *path) : *path;
        auto plan = co_await native_->plan(seen, port);
        if (!plan) {
            slurm_.forget(name);
            co_return plan.error();
        }
        plan->job = name;
        if (is_copied)
            copy(plan->process, spec, folder);
        auto& process = plan->process;
        if (plan->command.empty())
            plan->command = in_one_line(process.argv);
        auto const& job = core::job_for(slurm_.config(), spec.mode, spec.needed_labels);
        plan->job_memory = job.memory;
        process.remote.command =
            core::srun_command(slurm_.facts().srun, job, plan->job, core::job_time_limit(config_), is_copied);
        process.remote.first_port = port;
        process.remote.last_port =
            static_cast<std::uint16_t>(std::min(port + core::ports_tried_by_webots, 65535));
        for (auto& variable : slurm_.environment())
            process.environment.push_back(std::move(variable));
        // By its name: it runs also where we have died, and nobody may have read the number of the job.
        process.cleanup_command = {slurm_.facts().scancel.native(), "--quiet", "--name=" + plan->job};
        co_return plan;
    }

    void forget(LaunchPlan const& plan) noexcept override { slurm_.forget(plan.job); }

    bool leaves_something() const noexcept override { return true; }

    asio::awaitable<void> clear(LaunchPlan const& plan) override
    {
        slurm_.forget(plan.job);
        co_return;
    }

    PrintedLine read(std::string_view line, LaunchPlan const& plan) override
    {
        return native_->read(line, plan);
    }

    bool keeps_its_port() const noexcept override { return false; }

    std::string news_of(LaunchPlan const& plan) const override { return slurm_.news_of(plan.job); }

    asio::awaitable<result<std::string>> address_of(std::string node) override
    {
        return slurm_.address_of(std::move(node));
    }

    /// A second program in the job gets the file as the job has got its project, and puts it into that.
    ProcessSpec put_back(LaunchPlan const& plan, std::string_view number, fs::path const& file) override
    {
        auto const& to = plan.process.remote.copied_to;
        ProcessSpec process;
        if (to.empty())
            return process;
        auto from = to;
        from += core::concat(".", std::to_string(++turn_));
        process.argv = {slurm_.facts().guard.native(), "--put", from.native(), to.native(),
                        file.relative_path().native()};
        process.environment = plan.process.environment;
        process.directory = "/";
        process.remote.command = core::step_command(slurm_.facts().srun, number);
        process.remote.first_port = plan.process.remote.first_port;
        process.remote.last_port = plan.process.remote.last_port;
        process.remote.copied = {file};
        process.remote.copied_to = from;
        return process;
    }

private:
    void copy(ProcessSpec& process, LaunchSpec const& spec, fs::path const& folder) const;

    SimulationLauncherConfig const& config_;
    SimulationLauncherFacts const& facts_;
    SlurmMode& slurm_;
    std::unique_ptr<SimulatorRuntime> native_;
    std::uint64_t turn_ = 0; ///< Of files that were put back.
};

/// Has the project copied into `folder` on the node, with what the sandbox needs of our own files.
void SlurmRuntime::copy(ProcessSpec& process, LaunchSpec const& spec, fs::path const& folder) const
{
    auto& remote = process.remote;
    remote.copied_to = folder;
    remote.copied = {project_folder(spec)};
    auto const& sandbox = facts_.sandbox;
    if (sandbox.is_none()) {
        core::remove_variable(process.environment, "TMPDIR"); // ours
        return;
    }
    auto const add = [&](fs::path& file) {
        remote.copied.push_back(file);
        file = there(folder, file);
    };
    if (process.network.reach == ProcessNetwork::Reach::internet)
        add(process.network.rules);
    for (auto file :
         {sandbox.network.reach == ProcessNetwork::Reach::internet ? sandbox.resolver : fs::path(),
          sandbox.firejail_profile}) {
        if (file.empty())
            continue;
        // The sandbox names these files on its command line, which was made with their paths here.
        auto const ours = file.native();
        add(file);
        for (auto& word : process.argv)
            if (auto const at = word.find(ours); at != std::string::npos)
                word.replace(at, ours.size(), file.native());
    }
}

} // namespace

std::unique_ptr<SimulatorRuntime> make_slurm_runtime(SimulationLauncherConfig const& config,
                                                     SimulationLauncherFacts const& facts, SlurmMode& slurm)
{
    return std::make_unique<SlurmRuntime>(config, facts, slurm);
}

} // namespace webots_cloud
