#include "unit_test.hpp"

#include "core/relay/machine_conversation.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;
using namespace std::chrono_literals;

// Protocol sections 4.1.3 and 13.16.
BOOST_AUTO_TEST_SUITE(machine_conversation)

namespace {

constexpr bool ours = true;
constexpr bool python = false;

MachineConversation conversation(bool is_ours = ours, RelayOptions options = RelayOptions())
{
    return {std::move(options), "m:2000", is_ours};
}

} // namespace

BOOST_AUTO_TEST_CASE(what_a_machine_says_goes_to_the_browser)
{
    auto with = conversation();
    for (auto const* message : {"ide: enable", "shutdownTimeout: 7200", "loading: Receiving objects 40%",
                                "webots:ws://m:2001", ".", "reset controller: a/b.py"}) {
        auto const step = with.take(message);
        BOOST_TEST(step.for_browser == message);
        BOOST_TEST((step.refusal == MachineRefusal::none));
    }
    BOOST_TEST(with.is_ready());
    BOOST_TEST((with.on_end() == MachineRefusal::none));
}

BOOST_AUTO_TEST_CASE(heartbeats_are_for_browsers_that_asked)
{
    auto without = conversation();
    BOOST_TEST(without.take("heartbeat: 1").for_browser.empty());
    BOOST_TEST(without.take(".").for_browser.empty());
    RelayOptions options;
    options.wants_heartbeat = true;
    auto with = conversation(ours, options);
    BOOST_TEST(with.take("heartbeat: 1").for_browser == "heartbeat: 1");
    BOOST_TEST(with.take(".").for_browser == ".");
}

BOOST_AUTO_TEST_CASE(tokens_name_the_machine_for_browsers_that_return)
{
    BOOST_TEST(conversation().take("reconnectToken: abc").for_browser.empty());
    RelayOptions options;
    options.can_return = true;
    BOOST_TEST(conversation(ours, options).take("reconnectToken: abc").for_browser ==
               "reconnectToken: abc@m:2000");
}

BOOST_AUTO_TEST_CASE(a_refusal_is_the_session_servers_to_know)
{
    for (auto const& [message, refusal] :
         {std::pair{"refusal: full", MachineRefusal::full},
          std::pair{"refusal: machine", MachineRefusal::machine},
          std::pair{"refusal: of a later version", MachineRefusal::machine}}) {
        auto with = conversation();
        auto const announced = with.take(message);
        BOOST_TEST(announced.for_browser.empty());
        BOOST_TEST((announced.refusal == MachineRefusal::none));
        auto const said = with.take("loading: Error: No room.");
        BOOST_TEST(said.for_browser.empty());
        BOOST_TEST((said.refusal == refusal));
        BOOST_TEST(with.last_word() == "No room.");
    }
}

BOOST_AUTO_TEST_CASE(a_refusal_counts_although_its_sentence_is_lost)
{
    auto with = conversation();
    (void)with.take("refusal: full");
    BOOST_TEST((with.on_end() == MachineRefusal::full));
}

BOOST_AUTO_TEST_CASE(labels_that_a_world_needs_are_named)
{
    auto with = conversation();
    (void)with.take("refusal: needs docker  gpu");
    BOOST_TEST((with.take("loading: Error: Not here.").refusal == MachineRefusal::needs));
    BOOST_TEST(with.needs() == (std::vector<std::string>{"docker", "gpu"}), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_fault_of_the_project_is_the_same_everywhere)
{
    auto with = conversation();
    auto const step = with.take("loading: Error: Wrong Webots simulation URL");
    BOOST_TEST(step.for_browser == "loading: Error: Wrong Webots simulation URL");
    BOOST_TEST((step.refusal == MachineRefusal::none));
    BOOST_TEST((with.on_end() == MachineRefusal::none));
}

BOOST_AUTO_TEST_CASE(sentences_of_python_servers_about_the_machine_are_known)
{
    for (auto const* sentence :
         {"Docker not enabled: cannot host simulations from repositories outside of \"allowedRepositories\".",
          "This simulation server is not configured to share idle time.",
          "Cannot share idle time when current load is above threshold: 70.",
          "Cannot run simulation from blocked repository: u", "Unable to start Webots: webots --port=1"}) {
        auto const message = std::string("loading: Error: ") + sentence;
        BOOST_TEST((conversation(python).take(message).refusal == MachineRefusal::machine), sentence);
        BOOST_TEST((conversation(ours).take(message).refusal == MachineRefusal::none), sentence);
    }
}

BOOST_AUTO_TEST_CASE(a_reason_goes_to_browsers_that_asked_and_waits_while_another_machine_is_tried)
{
    constexpr auto reason = R"(reason: {"code":"no-world"})";
    BOOST_TEST(conversation().take(reason).for_browser.empty());
    RelayOptions options;
    options.wants_reasons = true;
    auto with = conversation(ours, options);
    BOOST_TEST(with.take(reason).for_browser == reason);
    auto other = conversation(ours, options);
    (void)other.take("refusal: machine");
    BOOST_TEST(other.take(reason).for_browser.empty());
    BOOST_TEST((other.take("loading: Error: Not here.").refusal == MachineRefusal::machine));
    BOOST_TEST(other.last_reason() == reason);
    auto pythons = conversation(python, options);
    (void)pythons.take("loading: Error: This simulation server is not configured to share idle time.");
    BOOST_TEST(pythons.last_reason() == R"(reason: {"code":"not-allowed"})");
}

BOOST_AUTO_TEST_CASE(errors_of_a_running_simulation_are_the_browsers)
{
    auto with = conversation();
    (void)with.take("webots:ws://m:2001");
    (void)with.take("refusal: full"); // whatever that means by now
    auto const step = with.take("loading: Error: The simulation used more memory than it may.");
    BOOST_TEST(!step.for_browser.empty());
    BOOST_TEST((step.refusal == MachineRefusal::none));
}

BOOST_AUTO_TEST_CASE(who_ends_without_a_word_is_silent)
{
    auto with = conversation();
    BOOST_TEST((with.on_end() == MachineRefusal::silent));
    (void)with.take("loading: Receiving objects 40%");
    BOOST_TEST((with.on_end() == MachineRefusal::silent));
}

BOOST_AUTO_TEST_CASE(patience_is_short_with_servers_that_speak_soon)
{
    auto with = conversation(ours);
    BOOST_TEST((with.patience() == Duration(10s)));
    (void)with.take("heartbeat: 1");
    (void)with.take("webots:ws://m:2001");
    BOOST_TEST((with.patience() == Duration(10s)));
    auto other = conversation(python);
    BOOST_TEST((other.patience() == Duration(5min)));
    (void)other.take("webots:ws://m:2001");
    BOOST_TEST((other.patience() == Duration::max()));
}

BOOST_AUTO_TEST_SUITE_END()
