#include "unit_test.hpp"

#include "core/docker/docker_project.hpp"

#include <algorithm>

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol section 6.3, and quirks Q5, Q28 and Q29.
BOOST_AUTO_TEST_SUITE(docker_project)

namespace {

constexpr auto repository = "cyberbotics/webots.cloud";

std::string image_of(std::string_view header)
{
    auto const image = default_docker_image(repository, header);
    return image ? *image : image.error().message();
}

DockerEnvironment environment()
{
    DockerEnvironment values;
    values.image = "cyberbotics/webots.cloud:R2025a-ubuntu22.04";
    values.port = 2001;
    values.project = "webots-2000-1f3a9c4d-aa-1";
    values.server = "webots-2000-1f3a9c4d";
    values.world = "arena.wbt";
    values.stream_mode = "w3d";
    values.display = ":0";
    return values;
}

std::string env_line(DockerEnvironment const& values, std::string const& key)
{
    auto const file = env_file(values);
    if (!file)
        return file.error().message();
    auto const found = ("\n" + *file).find("\n" + key + "=");
    return found == std::string::npos ? "" : file->substr(found, file->find('\n', found) - found);
}

std::vector<std::string> arguments(std::initializer_list<char const*> words)
{
    return {words.begin(), words.end()};
}

} // namespace

BOOST_AUTO_TEST_CASE(releases_before_R2023b_run_on_ubuntu_20_04_and_others_on_22_04)
{
    BOOST_TEST(image_of("#VRML_SIM R2022b utf8") == "cyberbotics/webots.cloud:R2022b-ubuntu20.04");
    BOOST_TEST(image_of("#VRML_SIM R2023a utf8") == "cyberbotics/webots.cloud:R2023a-ubuntu20.04");
    BOOST_TEST(image_of("#VRML_SIM R2023b utf8") == "cyberbotics/webots.cloud:R2023b-ubuntu22.04");
    BOOST_TEST(image_of("#VRML_SIM R2025a utf8") == "cyberbotics/webots.cloud:R2025a-ubuntu22.04");
    BOOST_TEST(image_of("#VRML_SIM nightly utf8") == "cyberbotics/webots.cloud:nightly-ubuntu22.04");
}

BOOST_AUTO_TEST_CASE(releases_before_R2022b_are_not_asked_which_robots_wait_for_controllers)
{
    for (auto const* release : {"R2019a", "R2021b", "R2022a"})
        BOOST_TEST(!can_name_extern_robots(std::string("#VRML_SIM ") + release + " utf8"), release);
    for (auto const* release : {"R2022b", "R2023a", "R2025a", "nightly"})
        BOOST_TEST(can_name_extern_robots(std::string("#VRML_SIM ") + release + " utf8"), release);
    auto values = environment();
    BOOST_TEST((env_file(values).value().find("--extern-urls") == std::string::npos));
    values.names_extern_robots = true;
    BOOST_TEST(
        (env_file(values).value().find("--heartbeat=5000 --extern-urls --stream") != std::string::npos));
}

BOOST_AUTO_TEST_CASE(a_world_without_a_version_is_refused_in_words)
{
    for (auto const header :
         {"", "#VRML_SIM", "#VRML_SIM ", "#X3D R2025a utf8", "#VRML_SIM R2025a\nDISPLAY=x utf8",
          "#VRML_SIM $(id) utf8", "#VRML_SIM a/b utf8"})
        BOOST_TEST(image_of(header).starts_with("The first line of the world names no version of Webots."),
                   header);
}

BOOST_AUTO_TEST_CASE(webots_yml_tells_the_compose_file_and_messages_in_the_order_of_its_lines)
{
    auto const yml =
        parse_webots_yml("publish: true\ntype: demo\ndockerCompose:theia:webots-project/controllers/\n");
    BOOST_TEST_REQUIRE(yml.has_value());
    BOOST_TEST(compose_template_file(yml->kind) == "docker-compose-theia.yml");
    BOOST_TEST(yml->volume == "webots-project/controllers/");
    BOOST_TEST(yml->messages == arguments({"type:demo\n", "ide: enable"}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_competition_is_spelt_with_a_space)
{
    auto const yml = parse_webots_yml(
        "dockerCompose: competition:webots-project/controllers/participant/\r\n  type: com petition");
    BOOST_TEST_REQUIRE(yml.has_value());
    BOOST_TEST(compose_template_file(yml->kind) == "docker-compose-competition.yml");
    BOOST_TEST(yml->volume == "webots-project/controllers/participant/");
    BOOST_TEST(yml->messages == arguments({"ide: enable", "type:competition\n"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(without_a_line_of_ours_the_default_compose_file_is_used)
{
    for (auto const text :
         {"", "publish: true", " dockerCompose:theia:x", "dockerCompose:", "dockerCompose: other"}) {
        auto const yml = parse_webots_yml(text);
        BOOST_TEST_REQUIRE(yml.has_value());
        BOOST_TEST(compose_template_file(yml->kind) == "docker-compose-default.yml");
        BOOST_TEST(yml->messages.empty());
    }
}

BOOST_AUTO_TEST_CASE(a_folder_is_what_its_path_leads_to_below_usr_local)
{
    auto const volume = [](std::string const& folder) {
        auto const yml = parse_webots_yml("dockerCompose: competition:" + folder + "\n");
        return yml ? yml->volume : "refused";
    };
    // As some official competitions have it.
    BOOST_TEST(volume("../../../usr/local/webots-project/controllers/") == "webots-project/controllers/");
    BOOST_TEST(volume("../local/webots-project") == "webots-project");
    BOOST_TEST(volume("a/../b/./c//d") == "b/c/d");
    BOOST_TEST(volume("../../usr/local/a/..b/") == "a/..b/");
    for (std::string const folder :
         {".", "..", "a/..", "a/../../b", "../localx/a", "../../../../etc", "../../usr/local",
          "../../usr/local/", "../../usr/local/../lib", "/usr/local/webots-project"})
        BOOST_TEST(volume(folder) == "refused", folder);
}

BOOST_AUTO_TEST_CASE(a_line_with_too_few_fields_or_a_folder_that_leads_out_is_refused_in_words)
{
    for (auto const text :
         {"dockerCompose:theia", "dockerCompose:theia:", "dockerCompose: competition",
          "dockerCompose:theia:/etc", "dockerCompose:theia:../x", "dockerCompose:theia:a/../../b",
          "dockerCompose:theia:a b", "dockerCompose:theia:$HOME", "dockerCompose:theia:a\"b"}) {
        auto const yml = parse_webots_yml(text);
        BOOST_TEST_REQUIRE(!yml.has_value(), text);
        BOOST_TEST(yml.error().message().starts_with("Wrong line in webots.yml: \"dockerCompose:"));
    }
}

BOOST_AUTO_TEST_CASE(the_participant_of_a_competition_becomes_an_extern_controller)
{
    BOOST_TEST(
        with_extern_participant("A { controller \"participant\" }\nB { controller \"judge\" controller "
                                "\"participant\" }") ==
        "A { controller \"<extern>\" }\nB { controller \"judge\" controller \"<extern>\" }");
    BOOST_TEST(with_extern_participant("") == "");
}

BOOST_AUTO_TEST_CASE(the_last_step_of_an_image_costs_nothing)
{
    BOOST_TEST(with_last_step("FROM a\nRUN make", "s") == "FROM a\nRUN make\nLABEL webots_cloud.server=s\n");
}

BOOST_AUTO_TEST_CASE(the_name_of_a_simulation_has_what_nobody_guesses)
{
    BOOST_TEST(compose_project("webots-2000-1f3a9c4d", "17", "0a1b") == "webots-2000-1f3a9c4d-17-0a1b");
}

BOOST_AUTO_TEST_CASE(the_env_file_holds_what_compose_puts_into_its_file)
{
    auto const file = env_file(environment());
    BOOST_TEST_REQUIRE(file.has_value());
    BOOST_TEST(*file == "IMAGE=cyberbotics/webots.cloud:R2025a-ubuntu22.04\n"
                        "PROJECT_PATH=/usr/local/webots-project\n"
                        "MAKE=0\n"
                        "PORT=2001\n"
                        "COMPOSE_PROJECT_NAME=webots-2000-1f3a9c4d-aa-1\n"
                        "WEBOTS=\"/usr/local/webots/webots --batch --mode=pause --minimize --no-rendering "
                        "--port=2001 --heartbeat=5000 "
                        "--stream /usr/local/webots-project/worlds/arena.wbt\"\n"
                        "DISPLAY=:0\n"
                        "SERVER=webots-2000-1f3a9c4d\n"
                        "RUNTIME=runc\n"
                        "GRAPHICS_DEVICE=/dev/null\n"
                        "PORT_PREFIX=\n");
}

BOOST_AUTO_TEST_CASE(behind_the_gateway_ports_are_open_to_this_machine_alone)
{
    auto values = environment();
    values.port_prefix = "127.0.0.1:";
    BOOST_TEST(env_line(values, "PORT_PREFIX") == "PORT_PREFIX=127.0.0.1:");
    BOOST_TEST(env_line(values, "PORT") == "PORT=2001");
}

BOOST_AUTO_TEST_CASE(a_makefile_is_run_and_an_editor_gets_the_folder_and_a_port_500_above)
{
    auto values = environment();
    values.make = true;
    values.yml.kind = ComposeTemplate::theia;
    values.yml.volume = "webots-project/controllers/";
    BOOST_TEST(env_line(values, "MAKE") == "MAKE=1");
    BOOST_TEST(env_line(values, "THEIA_VOLUME") == "THEIA_VOLUME=webots-project/controllers/");
    BOOST_TEST(env_line(values, "THEIA_PORT") == "THEIA_PORT=2501");
}

BOOST_AUTO_TEST_CASE(a_world_with_spaces_is_one_argument)
{
    auto values = environment();
    values.world = "my world (2).wbt";
    BOOST_TEST(env_line(values, "WEBOTS").ends_with("'/usr/local/webots-project/worlds/my world (2).wbt'\""));
}

// Compose reads them, and splits the command, in docker_test.
BOOST_AUTO_TEST_CASE(what_means_nothing_between_quotes_may_be_in_the_name_of_a_world)
{
    auto values = environment();
    values.world = "R&D [50%] #1!.wbt";
    BOOST_TEST(
        env_line(values, "WEBOTS").ends_with(" '/usr/local/webots-project/worlds/R&D [50%] #1!.wbt'\""));
    values.world = "it's 'mine' #1.wbt";
    BOOST_TEST(
        env_line(values, "WEBOTS").ends_with(R"( \"/usr/local/webots-project/worlds/it's 'mine' #1.wbt\"")"));
    values.world = "a'.wbt";
    BOOST_TEST(env_line(values, "WEBOTS").ends_with(R"( \"/usr/local/webots-project/worlds/a'.wbt\"")"));
}

BOOST_AUTO_TEST_CASE(no_value_adds_a_line_or_leaves_its_quotes)
{
    for (auto const world : {"a\nIMAGE=evil.wbt", "a\".wbt", "a'\".wbt", "'; id.wbt", "$(id).wbt",
                             "a'${PATH}.wbt", "`id`.wbt", "a\\.wbt", "a'\\.wbt", "a;.wbt", "a\t.wbt"}) {
        auto values = environment();
        values.world = world;
        BOOST_TEST(env_line(values, "WEBOTS").starts_with("The name of the world file has characters"),
                   world);
    }
    auto values = environment();
    values.display = ":0\nIMAGE=evil";
    BOOST_TEST(!env_file(values).has_value());
}

BOOST_AUTO_TEST_CASE(compose_is_run_by_argument_vectors)
{
    BOOST_TEST(compose_up({"/usr/bin/docker", "compose"}, "/p q/docker-compose.yml") ==
                   arguments({"/usr/bin/docker", "compose", "-f", "/p q/docker-compose.yml", "-f",
                              "/p q/docker-compose.walls.yml", "up", "--build", "--no-color"}),
               boost::test_tools::per_element());
    BOOST_TEST(compose_down({"/usr/bin/docker-compose"}, "/p/docker-compose.yml") ==
                   arguments({"/usr/bin/docker-compose", "-f", "/p/docker-compose.yml", "-f",
                              "/p/docker-compose.walls.yml", "down", "-v", "--timeout", "0"}),
               boost::test_tools::per_element());
    BOOST_TEST(compose_restart_controller({"/usr/bin/docker-compose"}, "/p/docker-compose.yml") ==
                   arguments({"/usr/bin/docker-compose", "-f", "/p/docker-compose.yml", "-f",
                              "/p/docker-compose.walls.yml", "restart", "--timeout", "0", "controller"}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_file_is_brought_into_the_containers_that_have_the_project)
{
    BOOST_TEST(
        list_containers("webots-2000-1") ==
            arguments({"ps", "--no-trunc", "--filter", "label=com.docker.compose.project=webots-2000-1",
                       "--format", "{{.ID}}\t{{.Label \"com.docker.compose.service\"}}"}),
        boost::test_tools::per_element());
    BOOST_TEST(containers_with_project("a1\twebots\nb2\ttheia\nc3\tcontroller\nWARNING: no\n") ==
                   arguments({"a1", "c3"}),
               boost::test_tools::per_element());
    BOOST_TEST(copy_into_container("a1", "/i/1/project/controllers/a/a b.py", "controllers/a/a b.py") ==
                   arguments({"cp", "/i/1/project/controllers/a/a b.py",
                              "a1:/usr/local/webots-project/controllers/a/a b.py"}),
               boost::test_tools::per_element());
}

// Protocol 6.1: the environment with docker.
BOOST_AUTO_TEST_CASE(compose_gets_what_reaches_docker_and_nothing_that_changes_its_file)
{
    using Variables = std::vector<std::pair<std::string, std::string>>;
    auto const environment = docker_environment({{"PATH", "/bin"},
                                                 {"DOCKER_HOST", "unix:///x"},
                                                 {"DOCKER_BUILDKIT", "1"},
                                                 {"IMAGE", "evil"},
                                                 {"COMPOSE_FILE", "evil"},
                                                 {"AWS_SECRET", "x"}});
    Variables const expected{
        {"PATH", "/bin"}, {"DOCKER_HOST", "unix:///x"}, {"DOCKER_BUILDKIT", "0"}, {"PYTHONUNBUFFERED", "1"}};
    BOOST_TEST((environment == expected));
}

BOOST_AUTO_TEST_CASE(compose_files_may_refer_to_what_the_operator_lists_but_the_values_in_env_stay_ours)
{
    using Variables = std::vector<std::pair<std::string, std::string>>;
    auto const environment = docker_environment({{"PATH", "/bin"},
                                                 {"ROS_DOMAIN_ID", "7"},
                                                 {"ROS_TOKEN", "x"},
                                                 {"PORT", "evil"},
                                                 {"COMPOSE_FILE", "evil"},
                                                 {"LAB", "l"}},
                                                {"ROS_*", "PATH=/opt/bin", "*", "MODE=1"});
    Variables const expected{{"PATH", "/opt/bin"},
                             {"LAB", "l"},
                             {"MODE", "1"},
                             {"ROS_DOMAIN_ID", "7"},
                             {"DOCKER_BUILDKIT", "0"},
                             {"PYTHONUNBUFFERED", "1"}};
    BOOST_TEST((environment == expected));
}

BOOST_AUTO_TEST_SUITE_END()
