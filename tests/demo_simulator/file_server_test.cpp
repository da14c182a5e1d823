#include "file_server.hpp"
#include "name_sign.hpp"

#include <boost/test/unit_test.hpp>

// The leak sanitizer asks for it: what fontconfig keeps until the program ends is not ours.
// NOLINTBEGIN(bugprone-reserved-identifier): the name is the sanitizer's
extern "C" char const* __lsan_default_suppressions();
extern "C" char const* __lsan_default_suppressions()
{
    return "leak:libfontconfig.so\n";
}
// NOLINTEND(bugprone-reserved-identifier)

using namespace webots_cloud::demo;

namespace {

std::string answer_to(std::string const& target, bool serve_project,
                      std::vector<RobotDescription> const& robots)
{
    FileRequest request;
    request.target = target;
    return FileServer(WEBOTS_DEMO_PROJECTS "/robots", serve_project, robots).answer(request);
}

std::string status_of(std::string const& target, bool serve_project = true,
                      std::vector<RobotDescription> const& robots = {})
{
    std::string const answer = answer_to(target, serve_project, robots);
    return answer.substr(0, answer.find("\r\n"));
}

RobotDescription robot(std::string name, Colour colour = {})
{
    RobotDescription description;
    description.name = std::move(name);
    description.colour = colour;
    return description;
}

} // namespace

BOOST_AUTO_TEST_SUITE(file_server)

BOOST_AUTO_TEST_CASE(files_of_the_project_are_found_and_nothing_else)
{
    BOOST_TEST(status_of("/worlds/arena.wbt") == "HTTP/1.1 200 OK");
    BOOST_TEST(status_of("/worlds/%61rena.wbt?a=b") == "HTTP/1.1 200 OK");
    for (char const* target : {"/worlds", "/../README.md", "/%2e%2e/README.md", "/worlds/../../README.md",
                               "/missing", "", "/%", "/%4", "/%00", "/worlds/arena.wbt/"})
        BOOST_TEST(status_of(target) == "HTTP/1.1 404 Not Found", target);
}

BOOST_AUTO_TEST_CASE(the_built_in_page_needs_no_project)
{
    BOOST_TEST(status_of("/", false) == "HTTP/1.1 200 OK");
    BOOST_TEST(status_of("/worlds/arena.wbt", false) == "HTTP/1.1 404 Not Found");
    // Pictures that nobody has asked for would end the simulator.
    auto const page = answer_to("/", false, {});
    BOOST_TEST(page.find("send('mjpeg: ") < page.find("src = 'mjpeg'"));
    BOOST_TEST(page.find("<img src") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(the_name_of_each_robot_is_a_picture)
{
    std::vector<RobotDescription> const robots{robot("blue"), robot("../\xe9\x9d\x92 \"<>")};
    for (auto const& each : robots) {
        auto const path = "/" + sign_path(each);
        std::string const answer = answer_to(path, true, robots);
        BOOST_TEST(answer.starts_with("HTTP/1.1 200 OK"));
        BOOST_TEST(answer.find("Content-Type: image/png\r\n") != std::string::npos);
        BOOST_TEST(answer.find("\r\n\r\n\x89PNG") != std::string::npos);
        BOOST_TEST(status_of(path, true) == "HTTP/1.1 404 Not Found");
        BOOST_TEST(status_of(path, false, robots) == "HTTP/1.1 404 Not Found");
    }
    BOOST_TEST(sign_proportion(robot("a longer name")) > sign_proportion(robot("name")));
    BOOST_TEST(sign_path(robot("blue")) != sign_path(robot("red")));
    BOOST_TEST(sign_path(robot("blue")) != sign_path(robot("blue", {1, 0, 0})),
               "browsers would show what they have kept");
}

BOOST_AUTO_TEST_SUITE_END()
