#include "unit_test.hpp"

#include "core/refusals.hpp"
#include "core/simulation/client_protocol.hpp"

using namespace webots_cloud::core;

// Protocol section 4.1.
BOOST_AUTO_TEST_SUITE(client_protocol)

namespace {

StartMessage const& start_of(ClientMessage const& message)
{
    return std::get<StartMessage>(std::get<SimulationRequest>(message));
}

} // namespace

// Protocol 4.1.1.
BOOST_AUTO_TEST_CASE(the_shipped_clients_start_messages_are_understood)
{
    auto const plain =
        parse_client_message(R"({"start":{"url":"https://github.com/o/r/blob/m/worlds/a.wbt"}})");
    BOOST_TEST(start_of(plain).url == "https://github.com/o/r/blob/m/worlds/a.wbt");
    BOOST_TEST(start_of(plain).mode == "");
    BOOST_TEST(world_of(std::get<SimulationRequest>(plain)) == "https://github.com/o/r/blob/m/worlds/a.wbt");
    auto const video = parse_client_message(R"({"start":{"url":"u","mode":"mjpeg"}})");
    BOOST_TEST(start_of(video).mode == "mjpeg");
}

// Protocol 4.1.1.
BOOST_AUTO_TEST_CASE(a_start_says_what_the_page_can_do)
{
    auto const request = [](std::string const& members) {
        return std::get<SimulationRequest>(parse_client_message(R"({"start":{"url":"u")" + members + "}}"));
    };
    BOOST_TEST(!can_return(request("")));
    BOOST_TEST(!wants_heartbeat(request("")));
    BOOST_TEST(!can_extend(request("")));
    BOOST_TEST(!is_fetch_only(request("")));
    BOOST_TEST(!is_relayed(request("")));
    BOOST_TEST(!wants_reasons(request("")));
    BOOST_TEST(wants_reasons(request(R"(,"reasons":true)")));
    BOOST_TEST(is_relayed(request(R"(,"relayed":true)")));
    BOOST_TEST(is_fetch_only(request(R"(,"fetch_only":true)")));
    BOOST_TEST(can_extend(request(R"(,"extend":true)")));
    BOOST_TEST(can_return(request(R"(,"reconnect":true)")));
    BOOST_TEST(wants_heartbeat(request(R"(,"heartbeat":true)")));
    for (auto const* other : {"false", "null", "1", R"("true")", "{}"}) {
        BOOST_TEST(!can_return(request(std::string(R"(,"reconnect":)") + other)), other);
        BOOST_TEST(!wants_heartbeat(request(std::string(R"(,"heartbeat":)") + other)), other);
        BOOST_TEST(!is_fetch_only(request(std::string(R"(,"fetch_only":)") + other)), other);
        BOOST_TEST(!is_relayed(request(std::string(R"(,"relayed":)") + other)), other);
    }
    auto const old = parse_client_message(R"({"init":["https://w.org","p","a.wbt"]})");
    BOOST_TEST(!can_return(std::get<SimulationRequest>(old)));
    auto const website = parse_client_message(R"({"init":["https://w.org","p","a.wbt"],"reasons":true})");
    BOOST_TEST(wants_reasons(std::get<SimulationRequest>(website)));
}

// Protocol 4.1.3.
BOOST_AUTO_TEST_CASE(a_reason_says_to_programs_what_the_sentence_says_to_people)
{
    BOOST_TEST(reason_message(webots_cloud::core::refused(webots_cloud::core::Refused::no_world,
                                                          {{"file", "\"a\".wbt"}})) ==
               R"(reason: {"code":"no-world","values":{"file":"\"a\".wbt"}})");
    BOOST_TEST(reason_message(webots_cloud::core::refused(webots_cloud::core::Refused::quit)) ==
               R"(reason: {"code":"quit","values":{}})");
    BOOST_TEST(reason_message(webots_cloud::Failure(webots_cloud::errc::refused, "It is so.")) == "");
    BOOST_TEST(reason_message(webots_cloud::Failure(make_error_code(
                   boost::system::errc::no_space_on_device))) == R"(reason: {"code":"disk-full"})");
}

BOOST_AUTO_TEST_CASE(a_page_says_what_it_will_want_of_its_simulator)
{
    auto const start = std::get<StartMessage>(std::get<SimulationRequest>(
        parse_client_message(R"({"start":{"url":"u","mode":"mjpeg","size":"1280x665","run":true}})")));
    BOOST_TEST(start.picture_size == "1280x665");
    BOOST_TEST(start.runs);
    auto const other = std::get<StartMessage>(std::get<SimulationRequest>(
        parse_client_message(R"({"start":{"url":"u","mode":"mjpeg","size":{},"run":"yes"}})")));
    BOOST_TEST(other.picture_size.empty());
    BOOST_TEST(!other.runs);
}

// Protocol 4.1.4.
BOOST_AUTO_TEST_CASE(only_a_normal_close_or_one_without_a_code_is_final)
{
    BOOST_TEST(is_final(0));
    BOOST_TEST(is_final(1000));
    for (std::uint16_t const code : {1001, 1011, 4000, taken_over_code + 0})
        BOOST_TEST(!is_final(code), code);
}

// Protocol 4.1.1; quirk Q26.
BOOST_AUTO_TEST_CASE(a_controller_file_is_named_without_a_way_out_of_its_folder)
{
    auto const good = parse_client_message(R"({"reset controller":"walk/lib/gait.py","start":{"url":"u"}})");
    BOOST_TEST(std::get<ResetControllerMessage>(good).file == "walk/lib/gait.py"); // it comes before `start`
    for (auto const* value : {R"("walk")", R"("")", R"("/etc/passwd")", R"("walk/")", R"("../worlds/a.wbt")",
                              R"("walk/../x/y")", R"("walk/./x")", R"("walk//x")", R"("walk/.git/config")",
                              R"("a\\b/c")", R"("a/b\u0000")", "5", "null", R"(["walk","x"])"}) {
        auto const message = parse_client_message(std::string(R"({"reset controller":)") + value + "}");
        BOOST_TEST(std::holds_alternative<MalformedMessage>(message), value);
    }
    auto const long_name = R"({"reset controller":"a/)" + std::string(2000, 'b') + R"("})";
    BOOST_TEST(std::holds_alternative<MalformedMessage>(parse_client_message(long_name)));
}

BOOST_AUTO_TEST_CASE(a_browser_returns_with_a_token)
{
    BOOST_TEST(std::get<ReconnectMessage>(parse_client_message(R"({"reconnect":"abc"})")).token == "abc");
    BOOST_TEST(std::holds_alternative<MalformedMessage>(parse_client_message(R"({"reconnect":{}})")));
}

// Protocol 4.1.1.
BOOST_AUTO_TEST_CASE(a_browser_asks_for_more_time)
{
    auto const by = [](std::string const& seconds) {
        return std::get<ExtendMessage>(parse_client_message(R"({"extend":)" + seconds + "}")).by;
    };
    BOOST_TEST((by("600") == std::chrono::seconds(600)));
    BOOST_TEST((by("1.9") == std::chrono::seconds(1)));
    BOOST_TEST((by("1e300") == std::chrono::seconds(10'000'000)));
    for (auto const* wrong : {"0", "-5", "true", "null", R"("600")", "{}"}) {
        auto const message = parse_client_message(std::string(R"({"extend":)") + wrong + "}");
        BOOST_TEST(std::holds_alternative<MalformedMessage>(message), wrong);
    }
}

// Protocol 13.19.
BOOST_AUTO_TEST_CASE(programs_are_read_and_written_by_names_that_stay_in_their_folder)
{
    BOOST_TEST(
        (parse_client_message(R"({"read":"a/a.py"})") == ClientMessage(ReadFileMessage{"a/a.py", false})));
    BOOST_TEST(
        (parse_client_message(R"({"original":"a/a.py"})") == ClientMessage(ReadFileMessage{"a/a.py", true})));
    BOOST_TEST((parse_client_message(R"({"write":{"path":"a/a.py","text":"x"}})") ==
                ClientMessage(WriteFileMessage{"a/a.py", "x"})));
    BOOST_TEST((parse_client_message(R"({"compile":"a"})") == ClientMessage(CompileMessage{"a"})));
    std::string const program(100'000, 'x');
    BOOST_TEST((parse_client_message(R"({"write":{"path":"a/a.py","text":")" + program + "\"}}") ==
                ClientMessage(WriteFileMessage{"a/a.py", program})));
    for (auto const* text :
         {R"({"read":"a.py"})", R"({"read":"../a.py"})", R"({"read":"a/../../x"})",
          R"({"read":"/etc/passwd"})", R"({"read":5})", R"({"original":"a/.git"})", R"({"write":"a/a.py"})",
          R"({"write":{"path":"a/a.py"}})", R"({"write":{"text":"x"}})",
          R"({"write":{"path":"a/a.py","text":5}})", R"({"write":{"path":"a/..","text":""}})",
          R"({"write":{"path":"a/\u0000","text":""}})", R"({"compile":5})", R"({"compile":"a/b"})",
          R"({"compile":".."})"})
        BOOST_TEST(std::holds_alternative<MalformedMessage>(parse_client_message(text)), text);
}

// Section 5.1.
BOOST_AUTO_TEST_CASE(init_messages_are_lists_of_strings)
{
    auto const message =
        parse_client_message(R"({ "init" : [ "https://w.org", "p", "a.wbt", "", "\u00e9" ] })");
    auto const& request = std::get<SimulationRequest>(message);
    auto const& project = std::get<webots_cloud::WebsiteProject>(request);
    BOOST_TEST(project.project == "p");
    BOOST_TEST(project.user1_name == "\u00e9");
    BOOST_TEST(world_of(request) == "https://w.org/p/worlds/a.wbt");
    for (auto const* text :
         {R"({"init":"p"})", R"({"init":{}})", R"({"init":["h","p",5]})", R"({"init":["h",null,"a.wbt"]})"})
        BOOST_TEST((parse_client_message(text) ==
                    ClientMessage(MalformedMessage{"\"init\" must be a list of strings"})),
                   text);
}

// Protocol 4.1.1.
BOOST_AUTO_TEST_CASE(init_may_have_a_mode_beside_it)
{
    auto const message =
        parse_client_message(R"({ "init" : [ "https://w.org", "p", "a.wbt" ], "mode" : "mjpeg" })");
    BOOST_TEST(std::get<webots_cloud::WebsiteProject>(std::get<SimulationRequest>(message)).mode == "mjpeg");
    BOOST_TEST((parse_client_message(R"({"init":["https://w.org","p","a.wbt"],"mode":5})") ==
                ClientMessage(MalformedMessage{"the \"mode\" of \"init\" must be a string"})));
}

BOOST_AUTO_TEST_CASE(init_goes_before_start)
{
    auto const message = parse_client_message(R"({"start":{"url":"u"},"init":["h"]})");
    BOOST_TEST(
        (message == ClientMessage(MalformedMessage{"\"init\" must have three to nine elements, not 1"})));
}

// Protocol 13.20.
BOOST_AUTO_TEST_CASE(session_servers_say_what_is_to_be_ready_and_hear_what_is)
{
    StageMessage wanted;
    wanted.wishes.resize(2);
    wanted.wishes[0].url = "https://github.com/o/r/blob/m/worlds/a.wbt";
    wanted.wishes[0].mode = "mjpeg";
    wanted.wishes[0].count = 15;
    BOOST_TEST((parse_client_message(stage_message(wanted.wishes)) == ClientMessage(wanted)));
    BOOST_TEST((parse_client_message(R"({"stage":[]})") == ClientMessage(StageMessage())));
    for (auto const* wrong :
         {"5", "{}", "[5]", R"([{"url":"a","mode":"x3d"}])", R"([{"url":"a","mode":"x3d","count":-1}])",
          R"([{"url":"a","mode":"x3d","count":10001}])", R"([{"url":"a","count":1}])",
          R"([{"url":5,"mode":"x3d","count":1}])"}) {
        auto const message = parse_client_message(std::string(R"({"stage":)") + wrong + "}");
        BOOST_TEST(std::holds_alternative<MalformedMessage>(message), wrong);
    }
    wanted.wishes.resize(max_staging_wishes + 1);
    BOOST_TEST(std::holds_alternative<MalformedMessage>(parse_client_message(stage_message(wanted.wishes))));

    std::vector<StagedFigure> figures(1);
    figures[0].url = "u";
    figures[0].mode = "x3d";
    figures[0].ready = 12;
    figures[0].taken = 3;
    BOOST_TEST((parse_staged_message(staged_message(figures)) == figures));
    for (auto const* wrong : {"loading: Error: no", "[]", "{}", R"({"staged":5})",
                              R"({"staged":[{"url":"u","mode":"x3d","ready":-1,"taken":0}]})",
                              R"({"staged":[{"url":"u","mode":"x3d","ready":1}]})"})
        BOOST_TEST(!parse_staged_message(wrong).has_value(), wrong);
}

// Protocol 4.1.1.
BOOST_AUTO_TEST_CASE(objects_that_ask_for_nothing_are_ignored)
{
    BOOST_TEST(std::holds_alternative<UnknownMessage>(parse_client_message("{}")));
    BOOST_TEST(std::holds_alternative<UnknownMessage>(parse_client_message(R"({"reset":true})")));
}

// Protocol 4.1.1.
BOOST_AUTO_TEST_CASE(everything_that_killed_the_python_handler_gets_a_reason)
{
    for (auto const& text :
         {std::string("{"), std::string(), std::string("null"), std::string("5"), std::string("[]"),
          std::string(R"({"start":{}})"), std::string(R"({"start":{"url":5}})"),
          std::string(R"({"start":"u"})"), std::string(R"({"start":{"url":"u","mode":5}})"),
          std::string(10'000, '['), std::string("\xff\xfe"), std::string(R"({"start":{"url":"u"}}x)")}) {
        auto const message = parse_client_message(text);
        BOOST_TEST_REQUIRE(std::holds_alternative<MalformedMessage>(message), text);
        BOOST_TEST(!std::get<MalformedMessage>(message).reason.empty(), text);
    }
}

// Protocol 4.1.3 and 11.
BOOST_AUTO_TEST_CASE(addresses_follow_ssl_and_port_rewrite_independently)
{
    webots_cloud::PublicAddress address;
    address.host = "host.org";
    address.port = 2000;
    BOOST_TEST(webots_message(address, 2001) == "webots:wss://host.org/2001");
    BOOST_TEST(public_http_url(address) == "https://host.org/2000");
    address.ssl = false;
    BOOST_TEST(webots_message(address, 2001) == "webots:ws://host.org/2001");
    address.port_rewrite = false;
    BOOST_TEST(webots_message(address, 2001) == "webots:ws://host.org:2001");
}

// Protocol 4.1.3.
BOOST_AUTO_TEST_CASE(texts_to_browsers_are_exact)
{
    BOOST_TEST(error_message("x") == "loading: Error: x");
    BOOST_TEST(loading_message("x") == "loading: x");
    BOOST_TEST(shutdown_timeout_message(7200) == "shutdownTimeout: 7200");
    BOOST_TEST(reset_controller_message("walk/walk.py") == "reset controller: walk/walk.py");
    BOOST_TEST(reconnect_token_message("abc") == "reconnectToken: abc");
}

BOOST_AUTO_TEST_SUITE_END()
