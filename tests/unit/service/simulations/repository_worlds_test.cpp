#include "simulation_fixture.hpp"

#include <webots_cloud/testing/fixed_world_finder.hpp>

#include <optional>

using namespace webots_cloud;
using namespace std::chrono_literals;

BOOST_AUTO_TEST_SUITE(repository_worlds)

namespace {

ListedWorld listed_world(std::string url, std::string title = {})
{
    ListedWorld world(std::move(url));
    world.title = std::move(title);
    return world;
}

std::string const arena_url = "https://github.com/o/r/blob/main/worlds/arena.wbt";
std::string const arena_list = R"({"worlds":[{"url":")" + arena_url + R"(","title":"An arena"}]})";

struct ListFixture : SimulationFixture
{
    explicit ListFixture(ServiceSetup setup = simulation_service_setup(),
                         SimulationServiceHooks hooks = simulation_service_hooks())
        : SimulationFixture(std::move(setup), std::move(hooks))
    {
        source.listed = {listed_world(arena_url, "An arena")};
    }

    HttpResponse post(std::string_view body, std::string_view client = {},
                      std::string_view path = "/worlds/list")
    {
        auto const request = request_of(body, client, path);
        return world.run(service.respond_to_body(request));
    }

    static IncomingRequest request_of(std::string_view body, std::string_view client,
                                      std::string_view path = "/worlds/list")
    {
        IncomingRequest request;
        request.method = "POST";
        request.path = path;
        request.body = body;
        request.client = request.quota_key = client;
        return request;
    }
};

boost::asio::awaitable<void> ask(SimulationService& service, IncomingRequest const& request,
                                 std::optional<HttpResponse>& answer)
{
    auto told = co_await service.respond_to_body(request);
    answer = std::move(told);
}

bool is_busy(HttpResponse const& answer)
{
    return answer.status == 503 && answer.body.find(R"("code":"busy-lists")") != std::string::npos;
}

} // namespace

BOOST_AUTO_TEST_CASE(the_worlds_of_a_pasted_address_are_listed_once_for_all_who_paste_it)
{
    ListFixture fixture;
    for (auto const* address :
         {"https://github.com/o/r", " https://github.com/o/r/ \n", "https://github.com/o/r.git"}) {
        auto const answer = fixture.post(address);
        BOOST_TEST(answer.status == 200);
        BOOST_TEST(answer.body == arena_list);
    }
    BOOST_TEST_REQUIRE(fixture.source.lists.size() == 1u);
    BOOST_TEST(fixture.source.lists[0].project.ref_and_folder == "HEAD");
    BOOST_TEST((fixture.source.lists[0].limits.bytes <= std::uint64_t{64} << 20));
    (void)fixture.post("https://github.com/o/r/tree/main/worlds");
    BOOST_TEST_REQUIRE(fixture.source.lists.size() == 2u);
    BOOST_TEST(fixture.source.lists[1].project.ref_and_folder == "main/worlds");
    fixture.world.advance(31s);
    (void)fixture.post("https://github.com/o/r");
    BOOST_TEST(fixture.source.lists.size() == 3u);
}

BOOST_AUTO_TEST_CASE(only_requests_for_a_list_may_have_a_body)
{
    ListFixture fixture;
    auto const longest = [&](std::string_view method, std::string_view path) {
        auto request = ListFixture::request_of("x", {}, path);
        request.method = method;
        return fixture.service.max_body(request);
    };
    BOOST_TEST(longest("POST", "/worlds/list") == 4096u);
    BOOST_TEST(longest("POST", "/ticket/abc/worlds/list") == 4096u);
    for (auto const* path : {"/ticket/abc/client", "/client", "/worlds", "/load", "/ticket//worlds/list"})
        BOOST_TEST(longest("POST", path) == 0u, path);
    BOOST_TEST(longest("GET", "/worlds/list") == 0u);
}

BOOST_AUTO_TEST_CASE(the_rules_of_a_start_hold_for_the_address_and_for_each_world)
{
    auto setup = simulation_service_setup();
    setup.config.repositories.allowed = {"https://github.com/o/r/tree/main/good"};
    ListFixture fixture(setup);
    fixture.source.listed = {listed_world("https://github.com/o/r/blob/main/good/worlds/a.wbt"),
                             listed_world("https://github.com/o/r/blob/main/bad/worlds/b.wbt")};
    auto const refused = fixture.post("https://github.com/o/r");
    BOOST_TEST(refused.status == 503, "another machine may have other rules");
    BOOST_TEST(refused.body.find(R"("code":"not-allowed")") != std::string::npos);
    BOOST_TEST(fixture.source.lists.empty());
    auto const allowed = fixture.post("https://github.com/o/r/tree/main/good");
    BOOST_TEST(allowed.body ==
               R"({"worlds":[{"url":"https://github.com/o/r/blob/main/good/worlds/a.wbt"}]})");
}

BOOST_AUTO_TEST_CASE(what_is_wrong_is_told_and_whether_another_machine_may_do_better)
{
    ListFixture fixture;
    auto const at_fault = fixture.post("https://github.com/o");
    BOOST_TEST(at_fault.status == 200);
    BOOST_TEST(at_fault.body.find(R"("code":"no-list")") != std::string::npos);
    BOOST_TEST(fixture.post("https://evil.example/o/r").status == 200);
    fixture.source.fuse = testing::Fuse(1);
    auto const unable = fixture.post("https://github.com/o/r");
    BOOST_TEST(unable.status == 503);
    BOOST_TEST(unable.body.find(R"("error":)") != std::string::npos);
    BOOST_TEST(fixture.post("https://github.com/o/r").body == arena_list, "a failure is not kept");
}

BOOST_AUTO_TEST_CASE(a_slow_git_server_is_not_waited_for_and_neither_is_it_by_a_server_that_stops)
{
    ListFixture fixture;
    fixture.source.delay = 1min;
    auto const began = fixture.world.clock.now();
    auto const late = fixture.post("https://github.com/o/r");
    BOOST_TEST((fixture.world.clock.now() - began <= 20s));
    BOOST_TEST(late.body.find("https://github.com can't be reached: it takes too long") != std::string::npos);

    std::optional<HttpResponse> answer;
    auto const request = ListFixture::request_of("https://github.com/o/x", {});
    fixture.tasks.spawn(ask(fixture.service, request, answer));
    fixture.world.settle();
    BOOST_TEST(!answer);
    fixture.service.stopping();
    fixture.world.settle();
    BOOST_TEST_REQUIRE(answer.has_value());
    BOOST_TEST(answer->body.find("server-stops") != std::string::npos);
    BOOST_TEST(fixture.post("https://github.com/o/r").status == 503);
}

BOOST_AUTO_TEST_CASE(one_client_may_not_ask_for_list_after_list_nor_many_clients_at_once)
{
    ListFixture fixture;
    int answered = 0;
    for (int i = 0; i < 30; ++i)
        answered +=
            fixture.post("https://github.com/o/r" + std::to_string(i), "1.2.3.4").status == 200 ? 1 : 0;
    BOOST_TEST(answered == 20);
    BOOST_TEST(is_busy(fixture.post("https://github.com/o/other", "1.2.3.4")));
    BOOST_TEST(fixture.post("https://github.com/o/other", "1.2.3.5").status == 200);

    fixture.source.delay = 10s;
    std::vector<IncomingRequest> requests(5, ListFixture::request_of({}, {}));
    std::vector<std::string> addresses;
    std::vector<std::optional<HttpResponse>> answers(5);
    for (int i = 0; i < 5; ++i)
        addresses.push_back("https://github.com/o/at_once" + std::to_string(i));
    for (std::size_t i = 0; i < 5; ++i)
        requests[i].body = addresses[i];
    for (std::size_t i = 0; i < 5; ++i)
        fixture.tasks.spawn(ask(fixture.service, requests[i], answers[i]));
    fixture.world.settle();
    BOOST_TEST_REQUIRE(answers[4].has_value());
    BOOST_TEST(is_busy(*answers[4]));
    fixture.world.advance(11s);
    fixture.world.settle();
    for (std::size_t i = 0; i < 4; ++i)
        BOOST_TEST((answers[i] && answers[i]->status == 200));
}

BOOST_AUTO_TEST_CASE(where_starts_need_a_ticket_lists_do_too)
{
    auto hooks = simulation_service_hooks();
    hooks.refuse_ticket = [](std::string_view ticket) {
        return ticket == "good" ? std::nullopt : std::optional(Failure(errc::refused, "No ticket."));
    };
    ListFixture fixture(simulation_service_setup(), std::move(hooks));
    BOOST_TEST(fixture.post("https://github.com/o/r").body.find("No ticket.") != std::string::npos);
    BOOST_TEST(fixture.post("https://github.com/o/r", {}, "/ticket/good/worlds/list").body == arena_list);
    BOOST_TEST(fixture.source.lists.size() == 1u);
}

BOOST_AUTO_TEST_CASE(a_machine_that_drains_lists_nothing)
{
    ListFixture fixture;
    fixture.service.drain(false);
    BOOST_TEST(fixture.post("https://github.com/o/r").status == 503);
    BOOST_TEST(fixture.source.lists.empty());
}

BOOST_AUTO_TEST_CASE(worlds_in_plain_folders_are_those_that_were_found_there)
{
    FoundWorld one;
    one.forge = "https://github.com";
    one.world = listed_world("https://github.com/o/r/blob/main/a/worlds/one.wbt", "One");
    auto two = one;
    two.world = listed_world("https://github.com/o/r/blob/main/ab/worlds/two.wbt", "Two");
    auto other = one;
    other.world = listed_world("https://github.com/o/r2/blob/main/a/worlds/three.wbt");
    testing::FixedWorldFinder finder;
    finder.worlds = {one, two, other};
    auto hooks = simulation_service_hooks();
    hooks.world_finder = &finder;
    ListFixture fixture(simulation_service_setup(), std::move(hooks));
    fixture.source.refs = RefMeaning::none;
    fixture.source.local = true;
    auto const titles = [&](std::string_view address) {
        auto const body = fixture.post(address).body;
        return std::string(body.find("One") != std::string::npos ? "one " : "") +
               (body.find("Two") != std::string::npos ? "two" : "");
    };
    BOOST_TEST(titles("https://github.com/o/r") == "one two");
    BOOST_TEST(titles("https://github.com/o/r/tree/main/a") == "one ");
    BOOST_TEST(titles("https://github.com/o/r/tree/any/a/worlds") == "one ");
    BOOST_TEST(titles("https://github.com/o/r/tree/main/c") == "");
    BOOST_TEST(fixture.source.lists.empty());
}

BOOST_AUTO_TEST_CASE(a_server_to_which_refs_mean_nothing_is_asked_all_the_same)
{
    ListFixture fixture;
    fixture.source.refs = RefMeaning::none;
    BOOST_TEST(fixture.post("https://github.com/o/r").status == 200);
    BOOST_TEST(fixture.source.lists.size() == 1u);
}

BOOST_AUTO_TEST_SUITE_END()
