// Decisions: core/docker/compose_output.
#include "simulator_runtime.hpp"

#include <utility>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

/// Containers: what they need is DockerMode's, which all of them share.
class DockerRuntime final : public SimulatorRuntime
{
public:
    explicit DockerRuntime(DockerMode& docker) : docker_(docker) {}

    asio::awaitable<result<LaunchPlan>> plan(LaunchSpec const& spec, std::uint16_t port) override
    {
        return docker_.prepare(spec, port);
    }

    void forget(LaunchPlan const& plan) noexcept override { docker_.forget(plan.project); }

    bool leaves_something() const noexcept override { return true; }

    asio::awaitable<void> clear(LaunchPlan const& plan) override { return docker_.clear(plan.project); }

    asio::awaitable<WrittenElsewhere> written_elsewhere(LaunchPlan const& plan) override
    {
        return docker_.written(plan.project);
    }

    asio::awaitable<result<>> put_into_containers(LaunchPlan const& plan, std::filesystem::path file) override
    {
        return docker_.put_back(plan.project, plan.process.directory, std::move(file));
    }

    PrintedLine read(std::string_view line, LaunchPlan const& plan) override
    {
        docker_.note(plan.project, line);
        PrintedLine printed;
        printed.line = core::parse_compose_line(line, plan.project);
        printed.is_progress = core::is_progress(line);
        return printed;
    }

    /// Docker listens on the port for the container, in which no other program can take the simulator's port.
    bool keeps_its_port() const noexcept override { return true; }

private:
    DockerMode& docker_;
};

} // namespace

std::unique_ptr<SimulatorRuntime> make_docker_runtime(DockerMode& docker)
{
    return std::make_unique<DockerRuntime>(docker);
}

} // namespace webots_cloud
