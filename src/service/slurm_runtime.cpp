#include "core/simulation/launch_plan.hpp"
#include "core/slurm/job_command.hpp"
#include "simulator_runtime.hpp"

#include <algorithm>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

/// A native program, but for the place where it runs.
class SlurmRuntime final : public SimulatorRuntime
{
public:
    SlurmRuntime(SimulationLauncherParams const& params, SlurmMode& slurm)
        : slurm_(slurm), native_(make_native_runtime(params))
    {}

    asio::awaitable<result<ContainerPlan>> plan(LaunchSpec const& spec, std::uint16_t port) override
    {
        auto plan = co_await native_->plan(spec, port);
        if (!plan)
            co_return plan.error();
        auto const& params = slurm_.params();
        plan->job = slurm_.new_job(spec.label);
        auto& process = plan->process;
        if (plan->command.empty())
            plan->command = in_one_line(process.argv);
        auto const& job = core::job_for(params.jobs, spec.mode, spec.needed_labels);
        process.remote.command = core::srun_command(params.srun, job, plan->job, params.time_limit);
        process.remote.first_port = port;
        process.remote.last_port =
            static_cast<std::uint16_t>(std::min(port + core::ports_tried_by_webots, 65535));
        for (auto& variable : slurm_.environment())
            process.environment.push_back(std::move(variable));
        process.cleanup_command = {params.scancel.native(), "--quiet", "--name=" + plan->job};
        co_return plan;
    }

    void forget(ContainerPlan const& plan) noexcept override { slurm_.forget(plan.job); }

    bool leaves_something() const noexcept override { return true; }

    asio::awaitable<void> clear(ContainerPlan const& plan) override
    {
        slurm_.forget(plan.job);
        co_return;
    }

    PrintedLine read(std::string_view line, ContainerPlan const& plan) const override
    {
        return native_->read(line, plan);
    }

    bool keeps_its_port() const noexcept override { return false; }

    std::string news_of(ContainerPlan const& plan) const override { return slurm_.news_of(plan.job); }

    asio::awaitable<result<std::string>> address_of(std::string node) override
    {
        return slurm_.address_of(std::move(node));
    }

private:
    SlurmMode& slurm_;
    std::unique_ptr<SimulatorRuntime> native_;
};

} // namespace

std::unique_ptr<SimulatorRuntime> make_slurm_runtime(SimulationLauncherParams const& params, SlurmMode& slurm)
{
    return std::make_unique<SlurmRuntime>(params, slurm);
}

} // namespace webots_cloud
