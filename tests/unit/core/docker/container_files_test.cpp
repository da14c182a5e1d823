#include "unit_test.hpp"

#include "core/docker/container_files.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol section 6.3.
BOOST_AUTO_TEST_SUITE(files_for_containers)

namespace {

using Texts = std::vector<std::optional<std::string>>;

std::vector<std::string> names_of(std::vector<ContainerFile> const& files)
{
    std::vector<std::string> names;
    for (auto const& [name, text] : files)
        names.push_back(name);
    return names;
}

CompetitionTexts competition()
{
    CompetitionTexts texts;
    texts.world = "Robot {\n  name \"participant\"\n  controller \"x\"\n}\n";
    texts.controller_dockerfile = "FROM scratch\n";
    return texts;
}

DockerfileTerms terms()
{
    DockerfileTerms terms;
    terms.images = "images";
    terms.server = "server";
    return terms;
}

} // namespace

BOOST_AUTO_TEST_CASE(of_two_spellings_of_webots_yml_the_first_counts)
{
    BOOST_TEST(ProjectTexts(Texts(6)).yml == "");
    Texts texts{"one", "two", std::nullopt, std::nullopt, std::nullopt, std::nullopt};
    BOOST_TEST(ProjectTexts(texts).yml == "one");
    texts[0].reset();
    BOOST_TEST(ProjectTexts(texts).yml == "two");
    texts[0] = ""; // it is there
    BOOST_TEST(ProjectTexts(texts).yml == "");
}

BOOST_AUTO_TEST_CASE(each_name_is_read_into_its_own_member)
{
    BOOST_TEST(ProjectTexts::names() ==
                   (std::vector<std::string>{"webots.yml", "webots.yaml", "Makefile", "Dockerfile",
                                             "docker-compose.yml", ".dockerignore"}),
               boost::test_tools::per_element());
    ProjectTexts const none((Texts(6)));
    BOOST_TEST(!none.has_makefile);
    BOOST_TEST(!none.has_compose_file);
    BOOST_TEST(!none.dockerfile.has_value());
    ProjectTexts const all(Texts{"", "", "", "FROM a", "", "build"});
    BOOST_TEST(all.has_makefile);
    BOOST_TEST(all.has_compose_file);
    BOOST_TEST(all.dockerfile.value() == "FROM a");
    BOOST_TEST(all.dockerignore == "build");
}

BOOST_AUTO_TEST_CASE(docker_caches_a_project_whatever_its_simulation_is_called)
{
    Texts texts(6);
    texts[5] = "build";
    auto const files =
        container_files(ProjectTexts(texts), "FROM x", "PORT=1", "services:", ContainerWalls());
    BOOST_TEST(
        (files ==
         std::vector<ContainerFile>{
             {"Dockerfile", "FROM x"},
             {".env", "PORT=1"},
             {"docker-compose.walls.yml", "\nservices:\n"},
             {"docker-compose.yml", "services:"},
             {".dockerignore",
              "build\n.env\ndocker-compose.yml\ndocker-compose.walls.yml\ndocker-compose.seccomp.json\n"
              ".dockerignore\n"}}));
}

BOOST_AUTO_TEST_CASE(the_browser_is_told_of_files_that_are_not_used)
{
    Texts texts(6);
    BOOST_TEST(unused_file_notes(ProjectTexts(texts), false).empty());
    texts[3] = "FROM a";
    BOOST_TEST(unused_file_notes(ProjectTexts(texts), true).empty());
    BOOST_TEST(unused_file_notes(ProjectTexts(texts), false).size() == 1u);
    texts[4] = "services:";
    BOOST_TEST(unused_file_notes(ProjectTexts(texts), false).size() == 2u);
    BOOST_TEST(unused_file_notes(ProjectTexts(texts), true).size() == 1u);
}

BOOST_AUTO_TEST_CASE(a_competition_needs_a_world_and_a_dockerfile_and_may_have_a_launcher)
{
    auto texts = competition();
    auto const files = competition_files(texts, "a.wbt", terms());
    BOOST_TEST_REQUIRE(files.has_value());
    BOOST_TEST(names_of(files->files) == (std::vector<std::string>{"worlds/a.wbt", "controllers/Dockerfile"}),
               boost::test_tools::per_element());
    BOOST_TEST(files->files.at(0).second == with_extern_participant(*texts.world));
    auto const dockerfile = project_dockerfile("FROM scratch\n", "controllers/Dockerfile", terms());
    BOOST_TEST(files->files.at(1).second == with_last_step(dockerfile->text, "server"));
    texts.controller_dockerfile = "FROM a";
    BOOST_TEST(competition_files(texts, "a.wbt", terms())
                   .error()
                   .message()
                   .starts_with("Line 1 of controllers/Dockerfile can't be used on this server: it names the "
                                "image \"a\" without"));
    texts.controller_dockerfile.reset();
    BOOST_TEST(competition_files(texts, "a.wbt", terms()).error().message() ==
               "A competition needs a Dockerfile in its folder controllers, and the project has none.");
    texts = competition();
    texts.world.reset();
    BOOST_TEST(!competition_files(texts, "a.wbt", terms()).has_value());
}

BOOST_AUTO_TEST_CASE(where_a_participants_dockerfile_does_not_say_what_to_start_the_launcher_does)
{
    auto texts = competition();
    texts.launcher = "import os";
    auto files = competition_files(texts, "a.wbt", terms())->files;
    BOOST_TEST(names_of(files) == (std::vector<std::string>{"worlds/a.wbt", "remote_controller_launcher.py",
                                                            "controllers/remote_controller_launcher.py",
                                                            "controllers/Dockerfile"}),
               boost::test_tools::per_element());
    BOOST_TEST(files.at(2).second == "import os");
    BOOST_TEST(files.back().second.ends_with(
        "COPY remote_controller_launcher.py /usr/local/\n"
        "CMD [\"python3\", \"/usr/local/remote_controller_launcher.py\"]\n\nLABEL "
        "webots_cloud.server=server\n"));
    for (std::string const start : {"ENTRYPOINT python3 -u participant.py", "cmd [\"./participant\"]"}) {
        texts.controller_dockerfile = "FROM scratch\n" + start + "\n";
        files = competition_files(texts, "a.wbt", terms())->files;
        BOOST_TEST(names_of(files) ==
                       (std::vector<std::string>{"worlds/a.wbt", "remote_controller_launcher.py",
                                                 "controllers/Dockerfile"}),
                   boost::test_tools::per_element());
        BOOST_TEST(files.back().second.find("launcher") == std::string::npos);
    }
    texts.controller_dockerfile = "FROM scratch AS build\nCMD x\nFROM scratch\nCOPY --from=build / /\n";
    BOOST_TEST(competition_files(texts, "a.wbt", terms())->files.size() == 4u);
    texts.launcher.reset();
    BOOST_TEST(competition_files(texts, "a.wbt", terms())->files.size() == 2u);
}

BOOST_AUTO_TEST_SUITE_END()
