#include "unit_test.hpp"

#include "service/route_table.hpp"

#include <array>
#include <string>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(route_table_of_a_server)

namespace {

struct Service
{
    bool is_operators(IncomingRequest const& request) const { return request.is_operator; }
    Answer page(IncomingRequest const&) { return HttpResponse(200, "text/plain", "page"); }
    Answer folder(IncomingRequest const& request)
    {
        return HttpResponse(200, "text/plain", std::string(request.path));
    }
    Answer secret(IncomingRequest const&) { return HttpResponse(200, "text/plain", "secret"); }
};

using core::Methods;

constexpr auto routes = std::to_array<Route<Service>>({
    {"/page", Methods::read, everybody, Upgrade::accepted, &Service::page, "X-Refused: yes\r\n"},
    {"/folder/first", Methods::read, everybody, Upgrade::ignored, &Service::page},
    {"/folder*", Methods::get, everybody, Upgrade::ignored, &Service::folder},
    {"/secret", Methods::post, &Service::is_operators, Upgrade::ignored, &Service::secret},
});

IncomingRequest request(std::string_view method, std::string_view path)
{
    IncomingRequest request;
    request.method = method;
    request.path = path;
    return request;
}

Answer answer(IncomingRequest const& request)
{
    Service service;
    return route_table::respond(std::span<Route<Service> const>(routes), service, request);
}

HttpResponse response(std::string_view method, std::string_view path, bool is_operator = false)
{
    auto asked = request(method, path);
    asked.is_operator = is_operator;
    return std::get<HttpResponse>(answer(asked));
}

std::string allowed(HttpResponse const& refusal)
{
    return refusal.status == 405 ? refusal.headers.at(0).second : "";
}

} // namespace

BOOST_AUTO_TEST_CASE(two_slashes_are_not_one_and_people_are_told_why)
{
    for (std::string const path : {"//page", "//", "//secret"}) {
        auto const answered = response("GET", path);
        BOOST_TEST(answered.status == 404, path);
        BOOST_TEST(answered.body.find("the proxy in front has added one") != std::string::npos, path);
    }
    BOOST_TEST(response("GET", "/nothing//page").body.find("proxy") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_path_is_found_as_it_is_written)
{
    BOOST_TEST(response("GET", "/page").body == "page");
    BOOST_TEST(response("HEAD", "/page").body == "page");
    for (auto const* path : {"/pag", "/page/", "/page*", "/Page", "", "/", "/other"})
        BOOST_TEST(response("GET", path).status == 404, path);
}

BOOST_AUTO_TEST_CASE(a_star_stands_for_any_rest_and_the_first_row_counts)
{
    for (std::string const path : {"/folder", "/folder/", "/folder/a/b", "/folders"})
        BOOST_TEST(response("GET", path).body == path);
    BOOST_TEST(response("GET", "/folder/first").body == "page");
    BOOST_TEST(response("GET", "/folde").status == 404);
}

BOOST_AUTO_TEST_CASE(other_methods_are_refused_with_those_that_are_allowed)
{
    BOOST_TEST(allowed(response("POST", "/page")) == "GET, HEAD");
    BOOST_TEST(response("POST", "/page").fixed_headers == "X-Refused: yes\r\n");
    BOOST_TEST(response("GET", "/page").fixed_headers == "");
    BOOST_TEST(allowed(response("HEAD", "/folder")) == "GET");
    BOOST_TEST(response("POST", "/other").status == 404);
}

BOOST_AUTO_TEST_CASE(a_path_is_hidden_from_those_who_may_not_ask_whatever_the_method)
{
    for (auto const* method : {"POST", "GET", "HEAD", "OPTIONS"})
        BOOST_TEST((response(method, "/secret") == response(method, "/other")), method);
    BOOST_TEST(response("POST", "/secret", true).body == "secret");
    BOOST_TEST(allowed(response("GET", "/secret", true)) == "POST");
}

BOOST_AUTO_TEST_CASE(health_checks_may_ask_for_options_of_the_whole_server)
{
    for (auto const* path : {"/", "*"}) {
        auto const answer = response("OPTIONS", path);
        BOOST_TEST(answer.status == 204, path);
        BOOST_TEST((answer.headers == HttpHeaders{{"Allow", "GET, HEAD, OPTIONS, POST"}}), path);
        BOOST_TEST(response("GET", path).status == 404, path);
    }
    BOOST_TEST(response("OPTIONS", "/page").status == 405);
}

BOOST_AUTO_TEST_CASE(websockets_are_accepted_only_where_the_table_says_so)
{
    auto handshake = request("GET", "/page");
    handshake.upgrade = true;
    BOOST_TEST(std::holds_alternative<AcceptWebSocket>(answer(handshake)));
    handshake.path = "/folder/first";
    BOOST_TEST(std::get<HttpResponse>(answer(handshake)).body == "page");
    handshake.path = "/other";
    BOOST_TEST(std::get<HttpResponse>(answer(handshake)).status == 404);
}

BOOST_AUTO_TEST_SUITE_END()
