// What a session server that relays starts is told of those that are refused.
#include "refusal_sentences.hpp"
#include "simulation_fixture.hpp"

#include <boost/system/errc.hpp>

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol 4.1.5.
BOOST_AUTO_TEST_SUITE(relayed_start)

namespace {

using Texts = std::vector<std::string>;

std::string start(std::string const& url, std::string const& members = {})
{
    return R"({"start":{"url":")" + url + R"(","mode":"mjpeg")" + members + "}}";
}

std::string const forge = "https://github.com/";
std::string const world_url = forge + "o/r/blob/main/worlds/a.wbt";
constexpr auto relayed = R"(,"relayed":true)";

std::string init(std::string const& members = {})
{
    return R"({"init":["https://w.org","robots","a.wbt"])" + members + "}";
}

ProcessLimits small_memory()
{
    ProcessLimits limits;
    limits.memory = 1'000'000;
    return limits;
}

struct Fixture : SimulationFixture
{
    explicit Fixture(ServiceSetup setup = simulation_service_setup(),
                     SimulationServiceHooks hooks = simulation_service_hooks())
        : SimulationFixture(std::move(setup), std::move(hooks), 2, small_memory())
    {}

    void drain()
    {
        IncomingRequest request;
        request.method = "POST";
        request.path = "/api/drain";
        request.is_operator = true;
        (void)service.respond(request);
    }

    void run_one()
    {
        processes.expect().prints(".\n");
        BOOST_TEST(say("", start(world_url)).was_told("webots:"));
    }

    void all_leave()
    {
        for (auto const& browser : browsers)
            if (!browser->close_code)
                leave(*browser);
    }
};

struct Case
{
    std::string name;
    std::string refusal; ///< Empty: none is sent.
    std::string error;   ///< How the error begins that follows.
    std::string url = world_url;
    void (*prepare)(Fixture&) = [](Fixture&) {};
};

Case const cases[] = {
    {"no place is free", "refusal: full", "Too many open connections (>2)", world_url,
     [](Fixture& f) {
         f.run_one();
         f.run_one();
     }},
    {"the server drains", "refusal: machine", "This simulation server is about to stop.", world_url,
     [](Fixture& f) { f.drain(); }},
    {"the policy forbids it", "refusal: machine", "Docker not enabled", forge + "x/r/blob/main/worlds/a.wbt"},
    {"the disk is full", "refusal: machine", "This server can't store the project", world_url,
     [](Fixture& f) {
         f.source.fuse = testing::Fuse(1, Failure(make_error_code(boost::system::errc::no_space_on_device),
                                                  "This server can't store the project"));
     }},
    {"the forge is out of reach", "refusal: machine", "github.com can't be reached", world_url,
     [](Fixture& f) {
         f.source.fuse = testing::Fuse(1, Failure(errc::unreachable, "github.com can't be reached"));
     }},
    {"all ports are in use", "refusal: machine", "Too many open connections (>2)", world_url,
     [](Fixture& f) {
         f.processes.taken = {2001, 2002};
     }},
    {"no program can be started", "refusal: machine", sentence(core::Refused::not_started, {{"why", ""}})},
    {"Webots crashes before it is ready", "refusal: machine",
     sentence(core::Refused::ended_early, {{"how", "it was ended by signal 11"}}), world_url,
     [](Fixture& f) { f.processes.expect().crashes(11); }},
    {"it never gets ready", "refusal: machine", sentence(core::Refused::not_loaded, {{"seconds", "300"}}),
     world_url, [](Fixture& f) { f.processes.expect().after(1000s).prints(".\n"); }},
    {"the address is of no forge", "", "Unsupported URL protocol",
     "https://evil.org/o/r/blob/main/worlds/a.wbt"},
    {"the address is wrong", "", "Wrong Webots simulation URL", forge + "o/r/raw"},
    {"there is no such world", "", "b.wbt does not exist.", forge + "o/r/blob/main/worlds/b.wbt"},
    {"its large files are refused", "", "The large files", world_url,
     [](Fixture& f) { f.source.fuse = testing::Fuse(1, Failure(errc::refused, "The large files")); }},
};

} // namespace

BOOST_AUTO_TEST_CASE(before_an_error_that_is_the_machines_a_session_server_is_told_so)
{
    for (auto const& each : cases) {
        Fixture fixture;
        each.prepare(fixture);
        auto& session_server = fixture.say("", start(each.url, relayed));
        fixture.world.advance(400s);
        auto const& sent = session_server.sent;
        BOOST_TEST_REQUIRE(!sent.empty(), each.name);
        BOOST_TEST(sent.back().starts_with("loading: Error: " + each.error),
                   each.name << ": " << sent.back());
        auto const before = sent.size() < 2 ? std::string() : sent[sent.size() - 2];
        BOOST_TEST((before.starts_with("refusal:") ? before : std::string()) == each.refusal, each.name);
        BOOST_TEST(session_server.close_code.has_value(), each.name);
        fixture.all_leave();
    }
}

BOOST_AUTO_TEST_CASE(browsers_are_told_nothing_but_the_error)
{
    for (auto const& each : cases) {
        Fixture fixture;
        each.prepare(fixture);
        auto& browser = fixture.say("", start(each.url));
        fixture.world.advance(400s);
        for (auto const& text : browser.sent)
            BOOST_TEST(!text.starts_with("refusal:"), each.name);
        BOOST_TEST(browser.sent.back().starts_with("loading: Error: " + each.error), each.name);
        fixture.all_leave();
    }
}

BOOST_AUTO_TEST_CASE(pages_that_ask_for_reasons_get_them_before_the_error)
{
    Fixture fixture;
    auto const missing = forge + "o/r/blob/main/robots/a.wbt";
    constexpr auto reason = R"(reason: {"code":"no-address","values":{"world":"a.wbt"}})";
    auto const error = error_line(core::Refused::address_not_in_worlds, {{"world", "a.wbt"}});
    BOOST_TEST(fixture.say("", start(missing, R"(,"reasons":true)")).sent == (Texts{reason, error}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.say("", start(missing)).sent == Texts{error}, boost::test_tools::per_element());
    fixture.drain();
    BOOST_TEST(fixture.say("", init(R"(,"reasons":true,"relayed":true)")).sent ==
                   (Texts{"refusal: machine", R"(reason: {"code":"server-stops","values":{}})",
                          "loading: Error: This simulation server is about to stop. Please start again on "
                          "another one."}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.say("", R"({"reconnect":"old"})").sent ==
                   (Texts{R"(reason: {"code":"ended","values":{}})",
                          "loading: Error: This simulation has ended. Please start it again."}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_client_with_its_share_is_refused_here_alone)
{
    auto setup = simulation_service_setup();
    setup.config.simulations_per_address = 1;
    Fixture fixture(std::move(setup));
    fixture.processes.expect().prints(".\n");
    auto& first = fixture.say("a", start(world_url, relayed));
    BOOST_TEST(first.was_told("webots:"));
    auto& second = fixture.say("a", start(world_url, relayed));
    BOOST_TEST_REQUIRE(second.sent.size() == 2u);
    BOOST_TEST(second.sent[0] == "refusal: machine");
    BOOST_TEST(second.sent[1].starts_with("loading: Error: Your network has 1 "));
    fixture.leave(first);
}

BOOST_AUTO_TEST_CASE(without_a_good_ticket_it_is_refused_here_alone)
{
    auto hooks = simulation_service_hooks();
    hooks.refuse_ticket = [](std::string_view) {
        return std::optional(Failure(errc::refused, "No ticket."));
    };
    Fixture fixture(simulation_service_setup(), std::move(hooks));
    for (auto const& message : {start(world_url, relayed), init(relayed)})
        BOOST_TEST(fixture.say("", message).sent == (Texts{"refusal: machine", "loading: Error: No ticket."}),
                   boost::test_tools::per_element());
    for (auto const& message : {start(world_url), init()})
        BOOST_TEST(fixture.say("", message).sent == (Texts{"loading: Error: No ticket."}),
                   boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_server_that_stops_sends_starts_to_others)
{
    Fixture fixture;
    fixture.source.delay = 5s;
    auto& session_server = fixture.say("", start(world_url, relayed));
    auto& browser = fixture.say("", start(world_url));
    fixture.service.stopping();
    fixture.world.settle();
    auto const error = "loading: Error: This simulation server is being stopped. Please start again.";
    BOOST_TEST(session_server.sent == (Texts{"refusal: machine", error}), boost::test_tools::per_element());
    BOOST_TEST(browser.sent == (Texts{error}), boost::test_tools::per_element());
    fixture.all_leave();
}

// Who ends it means it: another machine is not to begin it anew.
BOOST_AUTO_TEST_CASE(what_the_operator_ends_is_started_nowhere_else)
{
    Fixture fixture;
    fixture.processes.expect().after(100s).prints(".\n");
    auto& session_server = fixture.say("", start(world_url, relayed));
    IncomingRequest request;
    request.method = "POST";
    request.path = "/api/end";
    request.query = "simulation=1";
    request.is_operator = true;
    (void)fixture.service.respond(request);
    fixture.world.settle();
    BOOST_TEST(session_server.sent ==
                   (Texts{"shutdownTimeout: 600", "loading: Error: The operator has ended this simulation."}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_world_that_needs_too_much_before_it_is_ready_does_so_everywhere)
{
    Fixture fixture;
    fixture.processes.expect().prints("loading\n").consumes(10, 2'000'000);
    auto& session_server = fixture.say("", start(world_url, relayed));
    fixture.world.advance(10s);
    BOOST_TEST(session_server.close_code.has_value());
    for (auto const& text : session_server.sent)
        BOOST_TEST(!text.starts_with("refusal:"));
}

BOOST_AUTO_TEST_CASE(what_ends_after_it_was_ready_was_not_refused)
{
    Fixture fixture;
    fixture.processes.expect().prints(".\n").after(1s).exits(1);
    auto& session_server = fixture.say("", start(world_url, relayed));
    fixture.world.advance(1s);
    BOOST_TEST(session_server.was_told("webots:"));
    BOOST_TEST(session_server.sent.back() ==
               error_line(core::Refused::crashed, {{"how", "it exited with status 1"}}));
    for (auto const& text : session_server.sent)
        BOOST_TEST(!text.starts_with("refusal:"));
}

BOOST_AUTO_TEST_CASE(websites_are_told_apart_from_session_servers_too)
{
    Fixture fixture;
    fixture.drain();
    auto const error =
        "loading: Error: This simulation server is about to stop. Please start again on another one.";
    BOOST_TEST(fixture.say("", init(relayed)).sent == (Texts{"refusal: machine", error}),
               boost::test_tools::per_element());
    for (auto const* other : {"", R"(,"relayed":false)", R"(,"relayed":1)", R"(,"relayed":"true")"})
        BOOST_TEST(fixture.say("", init(other)).sent == (Texts{error}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_project_runs_only_where_its_labels_are)
{
    auto setup = simulation_service_setup();
    setup.facts.labels = {"gpu", "R2025a"};
    Fixture fixture(std::move(setup));
    fixture.source.webots_yml = "labels: gpu R2025a\n";
    fixture.processes.expect().prints(".\n");
    fixture.processes.expect().prints(".\n");
    for (auto const* members : {"", relayed}) {
        auto& taken = fixture.say("", start(world_url, members));
        BOOST_TEST(taken.was_told("webots:"), members);
        fixture.leave(taken);
    }
    fixture.source.webots_yml = "labels: gpu lidar big\n";
    std::string const lacks =
        "loading: Error: This simulation server can't run the project: it lacks what webots.yml asks for: "
        "lidar, big. Please start it on another one.";
    BOOST_TEST(fixture.say("", start(world_url)).sent == (Texts{lacks}), boost::test_tools::per_element());
    BOOST_TEST(fixture.say("", start(world_url, relayed)).sent ==
                   (Texts{"refusal: needs gpu lidar big", lacks}),
               boost::test_tools::per_element());
    BOOST_TEST(fixture.processes.started().size() == 2u);
    fixture.source.webots_yml = "labels: a,b\n";
    auto& wrong = fixture.say("", start(world_url, relayed));
    BOOST_TEST_REQUIRE(wrong.sent.size() == 1u);
    BOOST_TEST(wrong.sent[0].starts_with("loading: Error: Wrong line in webots.yml: \"labels: a,b\"."));
}

BOOST_AUTO_TEST_CASE(a_project_with_containers_runs_without_them_unless_another_machine_can_be_asked)
{
    Fixture fixture;
    fixture.source.webots_yml = "dockerCompose:theia:controllers/\n";
    fixture.processes.expect().prints(".\n");
    auto& browser = fixture.say("", start(world_url));
    BOOST_TEST(browser.sent == (Texts{"shutdownTimeout: 600", "webots:ws://host.org:2001"}),
               boost::test_tools::per_element());
    auto& session_server = fixture.say("", start(world_url, relayed));
    BOOST_TEST_REQUIRE(session_server.sent.size() == 2u);
    BOOST_TEST(session_server.sent[0] == "refusal: needs docker");
    BOOST_TEST(session_server.sent[1].find("it lacks what webots.yml asks for: docker.") !=
               std::string::npos);
    fixture.leave(browser);
}

BOOST_AUTO_TEST_CASE(what_is_only_fetched_needs_nothing)
{
    Fixture fixture;
    fixture.source.webots_yml = "labels: gpu\n";
    BOOST_TEST(
        fixture.say("", start(world_url, R"(,"relayed":true,"fetch_only":true)")).was_told("fetched:"));
}

BOOST_AUTO_TEST_SUITE_END()
