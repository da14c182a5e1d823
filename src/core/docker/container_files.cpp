#include "container_files.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

namespace webots_cloud::core {
namespace {

constexpr std::string_view launcher_steps =
    "COPY remote_controller_launcher.py /usr/local/\n"
    "CMD [\"python3\", \"/usr/local/remote_controller_launcher.py\"]\n";

} // namespace

std::vector<std::string> ProjectTexts::names()
{
    return {"webots.yml", "webots.yaml", "Makefile", "Dockerfile", "docker-compose.yml", ".dockerignore"};
}

ProjectTexts::ProjectTexts(std::vector<std::optional<std::string>> const& texts)
    : yml(texts.at(0) ? *texts.at(0) : texts.at(1).value_or("")), dockerfile(texts.at(3)),
      dockerignore(texts.at(5).value_or("")), has_makefile(texts.at(2)), has_compose_file(texts.at(4))
{}

result<CompetitionFiles> competition_files(CompetitionTexts const& texts, std::string const& world,
                                           DockerfileTerms const& terms)
{
    if (!texts.world || !texts.controller_dockerfile)
        return refused(Refused::no_competition_dockerfile);
    auto dockerfile = project_dockerfile(*texts.controller_dockerfile, controller_dockerfile, terms);
    if (!dockerfile)
        return dockerfile.error();
    CompetitionFiles competition;
    auto& files = competition.files;
    files.emplace_back(concat("worlds/", world), with_extern_participant(*texts.world));
    if (texts.launcher)
        files.emplace_back(controller_launcher, *texts.launcher);
    if (texts.launcher && !dockerfile->says_what_to_start) {
        files.emplace_back(concat("controllers/", controller_launcher), *texts.launcher);
        dockerfile->text.append(launcher_steps);
    }
    files.emplace_back(controller_dockerfile, with_last_step(dockerfile->text, terms.server));
    competition.bases = std::move(dockerfile->bases);
    return competition;
}

std::vector<ContainerFile> container_files(ProjectTexts const& project, std::string dockerfile,
                                           std::string env_file, std::string compose_file,
                                           ContainerWalls const& walls)
{
    std::vector<ContainerFile> files;
    files.emplace_back("Dockerfile", std::move(dockerfile));
    files.emplace_back(".env", std::move(env_file));
    files.emplace_back(walls_file_name, walls_file(compose_file, walls));
    files.emplace_back("docker-compose.yml", std::move(compose_file));
    // Without the files that differ from one simulation to the next, docker builds a project once and caches
    // the image.
    files.emplace_back(".dockerignore",
                       concat(project.dockerignore, "\n.env\ndocker-compose.yml\n", walls_file_name, "\n",
                              system_calls_file_name, "\n.dockerignore\n"));
    return files;
}

std::vector<std::string> unused_file_notes(ProjectTexts const& project, bool uses_project_dockerfile)
{
    std::vector<std::string> notes;
    if (project.dockerfile && !uses_project_dockerfile)
        notes.emplace_back("The Dockerfile of the project is not used: this server builds with its own.");
    if (project.has_compose_file)
        notes.emplace_back("The docker-compose.yml of the project is not used: this server runs its own.");
    return notes;
}

} // namespace webots_cloud::core
