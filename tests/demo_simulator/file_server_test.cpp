#include "file_server.hpp"

#include <boost/test/unit_test.hpp>

using namespace webots_cloud::demo;

namespace {

std::string status_of(std::string const& target, bool serve_project = true)
{
    FileRequest request;
    request.target = target;
    std::string const answer = FileServer(WEBOTS_DEMO_PROJECTS "/robots", serve_project).answer(request);
    return answer.substr(0, answer.find("\r\n"));
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
}

BOOST_AUTO_TEST_SUITE_END()
