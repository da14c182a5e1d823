#include "unit_test.hpp"

#include "core/relay/relay_messages.hpp"
#include "core/simulation/client_protocol.hpp"

using namespace webots_cloud::core;

// Protocol section 13.16.
BOOST_AUTO_TEST_SUITE(relay_messages)

BOOST_AUTO_TEST_CASE(what_todays_pages_send_has_no_options)
{
    auto const options = relay_options(R"({"start":{"url":"https://e.org/a.wbt","mode":"mjpeg"}})");
    BOOST_TEST(!options.shows_waiting);
    BOOST_TEST(options.waiting_ticket.empty());
    BOOST_TEST(options.student.empty());
    BOOST_TEST(!options.wants_heartbeat);
    BOOST_TEST(!options.can_return);
}

BOOST_AUTO_TEST_CASE(options_are_members_of_start_and_of_the_message_beside_init)
{
    for (
        auto const* request :
        {R"({"start":{"url":"u","waiting":true,"waitingTicket":"t","class":"s","heartbeat":true,"reconnect":true}})",
         R"({"init":["h","p","w.wbt"],"waiting":true,"waitingTicket":"t","class":"s","heartbeat":true,"reconnect":true})"}) {
        auto const options = relay_options(request);
        BOOST_TEST(options.shows_waiting);
        BOOST_TEST(options.waiting_ticket == "t");
        BOOST_TEST(options.student == "s");
        BOOST_TEST(options.wants_heartbeat);
        BOOST_TEST(options.can_return);
    }
}

BOOST_AUTO_TEST_CASE(members_of_other_types_are_no_options)
{
    for (auto const* request :
         {R"({"start":{"url":"u","waiting":1,"waitingTicket":7,"class":[],"heartbeat":"true"}})",
          R"({"start":[]})", "[]", "", "{"}) {
        auto const options = relay_options(request);
        BOOST_TEST(!options.shows_waiting);
        BOOST_TEST(options.waiting_ticket.empty());
        BOOST_TEST(options.student.empty());
        BOOST_TEST(!options.wants_heartbeat);
    }
}

BOOST_AUTO_TEST_CASE(a_machine_gets_the_request_without_what_is_for_the_session_server)
{
    BOOST_TEST(
        request_for_machine(
            R"({"start":{"url":"https://e.org/a/b","mode":"w3d","waiting":true,"waitingTicket":"t","class":"s","reconnect":true}})") ==
        R"({"start":{"url":"https://e.org/a/b","mode":"w3d","reconnect":true,"relayed":true,"heartbeat":true}})");
    BOOST_TEST(request_for_machine(R"({"init":["h","p","w.wbt"],"mode":"mjpeg"})") ==
               R"({"init":["h","p","w.wbt"],"mode":"mjpeg","relayed":true,"heartbeat":true})");
    auto const again = parse_client_message(request_for_machine(R"({"start":{"url":"ü\n\"","mode":null}})"));
    BOOST_TEST(std::get<StartMessage>(std::get<SimulationRequest>(again)).url == "ü\n\"");
}

BOOST_AUTO_TEST_CASE(a_token_leads_back_to_its_machine)
{
    for (auto const* entry : {"sim1.example.org:2000", "*/2000", "user@host/2000"}) {
        auto const text = relayed_token("abc", entry);
        auto const parsed = parse_relayed_token(text);
        BOOST_REQUIRE(parsed);
        BOOST_TEST(parsed->token == "abc");
        BOOST_TEST(parsed->entry == entry);
    }
    for (auto const* text : {"", "abc", "@", "abc@", "@host:2000"})
        BOOST_TEST(!parse_relayed_token(text), text);
}

BOOST_AUTO_TEST_CASE(a_return_names_the_token_as_json)
{
    BOOST_TEST(reconnect_message("a\"b") == R"({"reconnect":"a\"b"})");
}

BOOST_AUTO_TEST_SUITE_END()
