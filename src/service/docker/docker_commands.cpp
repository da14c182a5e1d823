// Decisions: core/docker/docker_project.
#include "docker_commands.hpp"

#include "core/docker/docker_project.hpp"
#include "service/run_program.hpp"

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

// For what Docker answers at once, on a machine that has very much to do.
constexpr auto command_limit = std::chrono::seconds(60);
// For what fetches an image.
constexpr auto long_limit = std::chrono::minutes(5);

} // namespace

ProcessSpec DockerCommands::spec(std::vector<std::string> argv) const
{
    ProcessSpec spec;
    spec.argv = std::move(argv);
    spec.environment = core::docker_environment(facts_.environment, launching_.simulator_environment);
    spec.directory = "/";
    spec.grace = Duration::zero();
    return spec;
}

asio::awaitable<result<std::string>> DockerCommands::run(ProcessSpec spec) const
{
    return run_program(processes_, clock_, std::move(spec), command_limit);
}

asio::awaitable<result<std::string>> DockerCommands::run(std::vector<std::string> argv) const
{
    return run(spec(std::move(argv)));
}

asio::awaitable<result<std::string>> DockerCommands::run_long(std::vector<std::string> argv) const
{
    return run_program(processes_, clock_, spec(std::move(argv)), long_limit);
}

asio::awaitable<result<std::string>> DockerCommands::docker(std::vector<std::string> arguments) const
{
    arguments.insert(arguments.begin(), facts_.docker.string());
    return run(std::move(arguments));
}

} // namespace webots_cloud
