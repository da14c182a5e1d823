// Decisions: core/docker/docker_engine.
#include "docker_discovery.hpp"

#include "core/docker/docker_engine.hpp"
#include "core/text.hpp"

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

using Arguments = std::vector<std::string>;

/// The beginning of compose's command line: it is a part of docker, or a program of its own.
asio::awaitable<result<Arguments>> find_compose(DockerFacts const& facts, DockerCommands const& commands)
{
    Arguments compose{facts.docker.string(), "compose"};
    Arguments ask{"compose", "version"};
    auto answer = co_await commands.docker(std::move(ask));
    if (!answer && !facts.docker_compose.empty()) {
        compose = {facts.docker_compose.string()};
        Arguments ask_program{facts.docker_compose.string(), "version"};
        answer = co_await commands.run(std::move(ask_program));
    }
    if (!answer)
        co_return Failure(errc::not_found, "docker: neither \"docker compose\" nor \"docker-compose\" can be "
                                           "run. Install one of them (package "
                                           "docker-compose), or set \"docker\" to false.");
    co_return compose;
}

} // namespace

asio::awaitable<result<DockerEngine>> find_docker(DockerFacts const& facts, DockerCommands const& commands)
{
    if (facts.docker.empty())
        co_return Failure(
            errc::not_found,
            "docker: there is no program \"docker\". Install Docker, or set \"docker\" to false.");
    auto const compose = co_await find_compose(facts, commands);
    if (!compose)
        co_return compose.error();
    Arguments ask{"info", "--format", std::string(core::docker_info_format)};
    auto const info = co_await commands.docker(std::move(ask));
    auto const runtime = info ? core::parse_container_runtime(*info) : std::nullopt;
    if (!runtime)
        co_return Failure(errc::unavailable,
                          concat("docker: the daemon does not answer: ",
                                 info ? "Is it running, and may this user use it?" : info.error().message()));
    DockerEngine engine;
    engine.compose = *compose;
    engine.runtime = *runtime;
    engine.confines_builds = core::confines_builds(*info);
    co_return engine;
}

asio::awaitable<void> open_screen(DockerFacts const& facts, DockerCommands const& commands, Logger const& log)
{
    if (facts.xhost.empty())
        co_return;
    Arguments argv{facts.xhost.string(), "+local:root"};
    auto spec = commands.spec(std::move(argv));
    spec.environment.emplace_back("DISPLAY", facts.display);
    auto const opened = co_await commands.run(std::move(spec));
    if (!opened)
        log.warning(
            concat("Containers can't use the screen ", facts.display, ": ", opened.error().message()));
}

} // namespace webots_cloud
