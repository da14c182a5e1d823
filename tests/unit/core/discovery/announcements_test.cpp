#include "unit_test.hpp"

#include "core/discovery/announcements.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::AnnouncedMachines;
using core::Announcement;
using core::AnnouncementVerdict;

BOOST_AUTO_TEST_SUITE(announcements)

namespace {

constexpr TimePoint now{};
constexpr WallTime wall{std::chrono::hours(24 * 365 * 50)};

Announcement announcement(std::string machine, Duration since = 0s, bool is_goodbye = false)
{
    Announcement made;
    made.machine = std::move(machine);
    made.at = wall + std::chrono::duration_cast<WallTime::duration>(since);
    made.is_goodbye = is_goodbye;
    return made;
}

std::string shown(AnnouncedMachines const& machines)
{
    std::string text;
    for (auto const& machine : machines.machines())
        text += machine + " ";
    return text;
}

} // namespace

BOOST_AUTO_TEST_CASE(an_announcement_is_a_query)
{
    auto const query = core::announcement_query(announcement("sim1.example.org:2000"));
    BOOST_TEST(query == "machine=sim1.example.org%3A2000&at=1576800000000");
    auto const read = core::parse_announcement(query);
    BOOST_TEST_REQUIRE(read.has_value());
    BOOST_TEST(read->machine == "sim1.example.org:2000");
    BOOST_TEST((read->at == wall));
    BOOST_TEST(!read->is_goodbye);
    BOOST_TEST(core::parse_announcement(query + "&goodbye")->is_goodbye);
    BOOST_TEST(read->receiver.empty());
    auto made = announcement("sim1.example.org:2000");
    made.receiver = "Ab-_9";
    made.is_goodbye = true;
    BOOST_TEST(core::announcement_query(made) == query + "&to=Ab-_9&goodbye");
    BOOST_TEST(core::parse_announcement(query + "&to=Ab-_9&goodbye")->receiver == "Ab-_9");
    for (auto const* const wrong :
         {"", "machine=", "machine=a%3A1", "at=1", "machine=&at=1",
          "machine=a%3A1&at=", "machine=a%3A1&at=-1", "machine=a%3A1&at=1x",
          "machine=a%3A1&at=99999999999999999999", "machine=a%3A1&at=5000000000000", "machine=%zz&at=1",
          "machine=a%3A1&at=1&more", "machine=a%3A1&at=1&to=", "machine=a%3A1&at=1&to=a%20b",
          "machine=a%3A1&to=a&at=1", "machine=a%3A1&at=1&to=a&to=b&"})
        BOOST_TEST(!core::parse_announcement(wrong).has_value(), wrong);
}

BOOST_AUTO_TEST_CASE(a_session_server_says_for_whom_to_sign)
{
    BOOST_TEST(core::parse_receiver_answer(core::receiver_answer("Ab-_9") + "\n").value_or("") == "Ab-_9");
    for (auto const& wrong :
         {std::string("Ab-_9"), core::receiver_answer(""), core::receiver_answer("a&goodbye"),
          core::receiver_answer(std::string(65, 'a'))})
        BOOST_TEST(!core::parse_receiver_answer(wrong).has_value(), wrong);
}

BOOST_AUTO_TEST_CASE(what_is_signed_says_what_it_is_for)
{
    auto const mac = [](std::string_view message) { return std::string(message); };
    BOOST_TEST(core::sign_announcement(mac, "q") == "Webots-Cloud d2Vib3RzX2Nsb3VkIGFubm91bmNlbWVudCAxCnE");
}

BOOST_AUTO_TEST_CASE(machines_are_known_until_they_say_goodbye_or_are_silent)
{
    AnnouncedMachines machines;
    BOOST_TEST((machines.take(announcement("B:1"), false, now, wall) == AnnouncementVerdict::accepted));
    machines.take(announcement("a/2000"), false, now, wall);
    BOOST_TEST(shown(machines) == "a/2000 b:1 ");
    machines.take(announcement("a/2000", 1s, true), false, now + 1s, wall + 1s);
    BOOST_TEST(shown(machines) == "b:1 ");
    BOOST_TEST(machines.forget_silent(now + 30s - 1ns, wall).empty());
    BOOST_TEST(machines.forget_silent(now + 30s, wall).front() == "b:1");
    BOOST_TEST(machines.size() == 0);
    machines.take(announcement("b:1", 40s), false, now + 40s, wall + 40s);
    BOOST_TEST(shown(machines) == "b:1 ");
}

BOOST_AUTO_TEST_CASE(what_was_sent_before_changes_nothing)
{
    AnnouncedMachines machines;
    auto const here = announcement("a:1");
    auto const gone = announcement("a:1", 1s, true);
    machines.take(here, false, now, wall);
    machines.take(gone, false, now, wall);
    BOOST_TEST((machines.take(here, false, now, wall) == AnnouncementVerdict::repeated));
    BOOST_TEST(shown(machines) == "");
    machines.take(announcement("a:1", 2s), false, now, wall);
    BOOST_TEST((machines.take(gone, false, now, wall) == AnnouncementVerdict::repeated));
    BOOST_TEST(shown(machines) == "a:1 ");
}

BOOST_AUTO_TEST_CASE(nothing_old_brings_back_a_machine_that_is_forgotten)
{
    AnnouncedMachines machines;
    auto const here = announcement("a:1");
    machines.take(here, false, now, wall);
    for (auto after = 30s; after < 200s; after += 10s) {
        machines.forget_silent(now + after, wall + after);
        BOOST_TEST((machines.take(here, false, now + after, wall + after) != AnnouncementVerdict::accepted));
    }
    BOOST_TEST(shown(machines) == "");
}

BOOST_AUTO_TEST_CASE(clocks_may_differ_by_two_minutes)
{
    AnnouncedMachines machines;
    for (auto const since : {-121s, 121s})
        BOOST_TEST(
            (machines.take(announcement("a:1", since), false, now, wall) == AnnouncementVerdict::outdated));
    for (auto const since : {-120s, 120s})
        BOOST_TEST(
            (machines.take(announcement("a:1", since), false, now, wall) == AnnouncementVerdict::accepted));
}

BOOST_AUTO_TEST_CASE(what_is_no_machine_for_browsers_is_refused)
{
    AnnouncedMachines machines;
    for (auto const* const machine :
         {"localhost:2000", "127.0.0.1:2000", "[::1]:2000", "169.254.1.1:2000", "a", "a:0", ":2000",
          "a b:2000", "a@b:2000", "dns:a:2000", "[x]/1:2", "a/", "a//b", "a/../b", "a/02000", "a:1/b"})
        BOOST_TEST((machines.take(announcement(machine), false, now, wall) == AnnouncementVerdict::refused),
                   machine);
    BOOST_TEST(
        (machines.take(announcement("localhost:2000"), true, now, wall) == AnnouncementVerdict::accepted));
    for (auto const* const machine :
         {"[2001:db8::2]:2000", "a/2000", "a.example.org/webots", "a/webots/2000"})
        BOOST_TEST((machines.take(announcement(machine), false, now, wall) == AnnouncementVerdict::accepted),
                   machine);
}

BOOST_AUTO_TEST_CASE(there_is_a_limit_for_all_together)
{
    AnnouncedMachines machines;
    for (std::size_t i = 0; i < AnnouncedMachines::max_machines; ++i)
        machines.take(announcement("sim" + std::to_string(i) + ":2000"), false, now, wall);
    BOOST_TEST(machines.size() == AnnouncedMachines::max_machines);
    BOOST_TEST((machines.take(announcement("a:1"), false, now, wall) == AnnouncementVerdict::too_many));
    BOOST_TEST(
        (machines.take(announcement("sim7:2000", 1s), false, now, wall) == AnnouncementVerdict::accepted));
    machines.forget_silent(now + 10min, wall + 10min);
    BOOST_TEST((machines.take(announcement("a:1", 10min), false, now, wall + 10min) ==
                AnnouncementVerdict::accepted));
}

BOOST_AUTO_TEST_CASE(no_more_are_here_than_may_be_whoever_is_remembered)
{
    AnnouncedMachines machines(2);
    auto const take = [&machines](char const* name, Duration at, bool goodbye = false) {
        auto one = announcement(name, at);
        one.is_goodbye = goodbye;
        return machines.take(one, false, now, wall);
    };
    BOOST_TEST((take("a:1", 0s) == AnnouncementVerdict::accepted));
    BOOST_TEST((take("b:1", 0s) == AnnouncementVerdict::accepted));
    BOOST_TEST((take("c:1", 0s) == AnnouncementVerdict::too_many));
    BOOST_TEST((take("b:1", 1s) == AnnouncementVerdict::accepted), "it is here");
    BOOST_TEST((take("a:1", 1s, true) == AnnouncementVerdict::accepted));
    BOOST_TEST((take("c:1", 1s) == AnnouncementVerdict::accepted), "there is room again");
    BOOST_TEST((take("a:1", 2s) == AnnouncementVerdict::too_many), "although it is remembered");
    BOOST_TEST(machines.size() == 2u);
}

BOOST_AUTO_TEST_SUITE_END()
