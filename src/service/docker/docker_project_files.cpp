// Writes compose file, walls, Dockerfile and .env beside a project, from templates. Images that projects
// start from are fetched.
// Decisions: core/docker/container_files.
#include "docker_project_files.hpp"

#include "core/refusals.hpp"
#include "core/sandbox/visible.hpp"
#include "core/text.hpp"

#include <webots_cloud/simulation_launcher.hpp>

namespace webots_cloud {
namespace asio = boost::asio;

using core::concat;

namespace {

using Names = std::vector<std::string>;

} // namespace

asio::awaitable<result<ContainerProject>>
DockerProjectFiles::write(LaunchSpec const& spec, std::uint16_t port, std::string const& runtime)
{
    auto const read = co_await files_.read(spec.root, core::ProjectTexts::names());
    if (!read)
        co_return read.error();
    core::ProjectTexts const texts(*read);
    auto values = environment(spec, port, runtime);
    if (!values)
        co_return values.error();
    auto const yml = core::parse_webots_yml(texts.yml);
    if (!yml)
        co_return yml.error();
    values->yml = *yml;
    values->make = texts.has_makefile;
    auto const env_file = core::env_file(*values);
    if (!env_file)
        co_return env_file.error();
    auto const compose_file = co_await read_template(core::compose_template_file(yml->kind));
    if (!compose_file)
        co_return compose_file.error();

    // The containers of a competition's controller are built on images of their own, which are checked with
    // the others.
    auto const terms = dockerfile_terms(*values);
    std::vector<core::ContainerFile> added;
    std::vector<std::string> bases;
    if (yml->kind == core::ComposeTemplate::competition) {
        auto competition = co_await competition_files(spec, terms);
        if (!competition)
            co_return competition.error();
        added = std::move(competition->files);
        bases = std::move(competition->bases);
    }
    if (core::compose_services(*compose_file).empty())
        co_return core::refused(core::Refused::no_compose_services,
                                {{"file", core::compose_template_file(yml->kind)}});
    bool const own = texts.dockerfile && config_.project_dockerfiles;
    bool const competes = yml->kind == core::ComposeTemplate::competition;
    // With our Dockerfile nothing of the project is run but its Makefile.
    auto walls = walls_of(*compose_file, own ? !config_.build_network : texts.has_makefile, competes);
    // The operator's list. Without it Docker's own holds, of which the operator was warned at the start.
    Names names{core::system_calls_template};
    auto const system_calls = co_await files_.read(config_.directory, std::move(names));
    if (!system_calls)
        co_return system_calls.error();
    walls.system_calls = system_calls->front().has_value();
    if (walls.system_calls)
        added.emplace_back(core::system_calls_file_name, *system_calls->front());
    auto const chosen = co_await choose_dockerfile(texts, own, terms);
    if (!chosen)
        co_return chosen.error();
    bases.insert(bases.end(), chosen->bases.begin(), chosen->bases.end());
    // An image that the project starts from can bring steps of its own into the build.
    auto const checked = co_await check_bases(std::move(bases));
    if (!checked)
        co_return checked.error();
    auto dockerfile = core::with_last_step(chosen->text, facts_.identity);
    for (auto& file : core::container_files(texts, std::move(dockerfile), *env_file, *compose_file, walls))
        added.push_back(std::move(file));
    std::vector<TextFile> files;
    for (auto& [name, text] : added)
        files.emplace_back(std::move(name), std::move(text));
    // Last, and all at once: a project that is refused has none of our files.
    auto const written = co_await files_.write(spec.root, std::move(files));
    if (!written)
        co_return written.error();

    ContainerProject project;
    project.environment = std::move(*values);
    project.uses_project_dockerfile = own;
    project.builds_what_it_says = own || texts.has_makefile || competes;
    project.own_network = walls.own_network;
    project.token = std::move(walls.token);
    project.notes = core::unused_file_notes(texts, own);
    if (walls.own_network && (own || competes) && !config_.build_network)
        project.notes.emplace_back("The Dockerfile of the project is built without a network, unless this "
                                   "server's operator sets \"buildNetwork\".");
    co_return project;
}

/// `confines_build`: the image is built without a network, where containers have their own.
core::ContainerWalls DockerProjectFiles::walls_of(std::string const& compose_file, bool confines_build,
                                                  bool competes) const
{
    core::ContainerWalls walls;
    walls.own_display = facts_.own_displays;
    walls.display_socket = display_socket();
    walls.own_network =
        facts_.network.reach != ProcessNetwork::Reach::host && !core::chooses_network(compose_file);
    walls.name_server = facts_.name_server;
    walls.limits = facts_.limits;
    walls.token = hooks_.new_token();
    walls.builds_without_network = walls.own_network && confines_build;
    walls.controller_builds_without_network = walls.own_network && competes && !config_.build_network;
    return walls;
}

std::filesystem::path DockerProjectFiles::display_socket() const
{
    auto const socket = core::display_socket(facts_.display);
    return hooks_.exists && hooks_.exists(socket) ? socket : std::filesystem::path();
}

result<core::DockerEnvironment> DockerProjectFiles::environment(LaunchSpec const& spec, std::uint16_t port,
                                                                std::string const& runtime) const
{
    auto image = core::default_docker_image(config_.images, spec.world_header);
    if (!image)
        return image.error();
    core::DockerEnvironment environment;
    environment.image = std::move(*image);
    environment.port = port;
    environment.project = core::compose_project(facts_.identity, spec.label, hooks_.new_token());
    environment.server = facts_.identity;
    environment.world = spec.world.filename().string();
    environment.stream_mode = spec.mode;
    environment.names_extern_robots =
        spec.names_extern_robots && core::can_name_extern_robots(spec.world_header);
    environment.display = facts_.display;
    environment.own_display = facts_.own_displays;
    environment.runtime = runtime;
    environment.graphics_device = facts_.graphics_device;
    if (launching_.gateway)
        environment.port_prefix = "127.0.0.1:";
    return environment;
}

core::DockerfileTerms DockerProjectFiles::dockerfile_terms(core::DockerEnvironment const& environment) const
{
    core::DockerfileTerms terms;
    terms.images = config_.images;
    terms.default_image = environment.image;
    terms.server = facts_.identity;
    return terms;
}

/// Gets images that projects start from, since what they have docker do in a build is not in the Dockerfile.
asio::awaitable<result<>> DockerProjectFiles::check_bases(std::vector<std::string> bases)
{
    for (auto const& base : bases) {
        auto ask = core::list_triggers(base);
        auto triggers = co_await commands_.docker(std::move(ask));
        if (!triggers) {
            Names pull{facts_.docker.string(), "pull", "--quiet", base};
            auto const pulled = co_await commands_.run_long(std::move(pull));
            if (!pulled)
                co_return core::refused(core::Refused::image_not_fetched,
                                        {{"image", base}, {"words", pulled.error().message()}});
            auto ask_again = core::list_triggers(base);
            triggers = co_await commands_.docker(std::move(ask_again));
        }
        if (!triggers || core::has_triggers(*triggers))
            co_return core::refused(core::Refused::image_with_triggers, {{"image", base}});
    }
    co_return result<>();
}

asio::awaitable<result<core::ProjectDockerfile>>
DockerProjectFiles::choose_dockerfile(core::ProjectTexts const& texts, bool own,
                                      core::DockerfileTerms const& terms)
{
    if (own)
        co_return core::project_dockerfile(*texts.dockerfile, "Dockerfile", terms);
    auto text = co_await read_template(core::dockerfile_template);
    if (!text)
        co_return text.error();
    core::ProjectDockerfile ours;
    ours.text = std::move(*text);
    co_return ours;
}

asio::awaitable<result<std::string>> DockerProjectFiles::read_template(std::string name)
{
    Names names{name};
    auto texts = co_await files_.read(config_.directory, std::move(names));
    if (!texts)
        co_return texts.error();
    if (!texts->front())
        co_return core::refused(core::Refused::no_docker_template,
                                {{"file", name}, {"folder", config_.directory.string()}});
    co_return std::move(*texts->front());
}

asio::awaitable<result<core::CompetitionFiles>>
DockerProjectFiles::competition_files(LaunchSpec const& spec, core::DockerfileTerms const& terms)
{
    auto const world = spec.world.filename().string();
    Names names{concat("worlds/", world), core::controller_dockerfile};
    auto const project = co_await files_.read(spec.root, std::move(names));
    if (!project)
        co_return project.error();
    core::CompetitionTexts texts;
    texts.world = project->at(0);
    texts.controller_dockerfile = project->at(1);
    Names launcher{core::controller_launcher};
    auto const ours = co_await files_.read(config_.directory, std::move(launcher));
    if (!ours)
        co_return ours.error();
    texts.launcher = ours->front();
    co_return core::competition_files(texts, world, terms);
}

} // namespace webots_cloud
