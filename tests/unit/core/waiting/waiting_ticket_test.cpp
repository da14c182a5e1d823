#include "unit_test.hpp"

#include "core/waiting/waiting_ticket.hpp"

#include <functional>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::WaitingTicket;
using core::WaitingTickets;

BOOST_AUTO_TEST_SUITE(waiting_ticket)

namespace {

constexpr WallTime noon{std::chrono::hours(400'000)};
constexpr Duration max_penalty = 5min;

/// Stands in for HMAC: different for every secret and message, which is all that matters here.
core::Mac mac_with(std::string secret)
{
    return [secret = std::move(secret)](std::string_view message) {
        std::string code;
        for (std::size_t i = 0; code.size() < 32; ++i) {
            auto const hash = std::hash<std::string>()(secret + std::string(message) + std::to_string(i));
            for (int shift = 0; shift < 64; shift += 8)
                code += static_cast<char>((hash >> shift) & 0xff);
        }
        return code;
    };
}

core::Mac const mac = mac_with("secret");

core::WaitingId id(int number)
{
    core::WaitingId id;
    id.fill('\xff');
    std::to_string(number).copy(id.data(), id.size());
    return id;
}

WaitingTicket ticket(WallTime rank = noon, WallTime issued = noon)
{
    return {id(1), core::waiting_group(mac, "203.0.113.7"), rank, issued};
}

std::optional<WaitingTicket> read(std::string_view text, WallTime now = noon)
{
    return core::read_waiting_ticket(mac, text, now, max_penalty);
}

bool is_usable(WallTime rank, WallTime issued, WallTime now = noon)
{
    return read(core::make_waiting_ticket(mac, ticket(rank, issued)), now).has_value();
}

} // namespace

BOOST_AUTO_TEST_CASE(what_is_made_can_be_read)
{
    auto const given = ticket(noon - 3h + 123456789ns, noon - 1s);
    auto const text = core::make_waiting_ticket(mac, given);
    BOOST_TEST(text.size() == core::waiting_ticket_size);
    auto const found = read(text).value();
    BOOST_TEST(found.id == given.id);
    BOOST_TEST(found.group == given.group);
    BOOST_TEST((found.rank == given.rank), "to the nanosecond: a rank never changes");
    BOOST_TEST((found.issued == given.issued));
    auto alone = given;
    alone.group.clear();
    BOOST_TEST(read(core::make_waiting_ticket(mac, alone)).value().group == "");
}

BOOST_AUTO_TEST_CASE(it_is_usable_for_a_minute_after_the_connection)
{
    BOOST_TEST(is_usable(noon, noon, noon + 80s));
    BOOST_TEST(!is_usable(noon, noon, noon + 80s + 1ns));
}

BOOST_AUTO_TEST_CASE(the_future_and_the_distant_past_are_refused)
{
    BOOST_TEST(is_usable(noon, noon + 5s));
    BOOST_TEST(!is_usable(noon, noon + 5s + 1ns));
    BOOST_TEST(is_usable(noon + 5min + 5s, noon), "a group that has much comes later");
    BOOST_TEST(!is_usable(noon + 5min + 5s + 1ns, noon));
    BOOST_TEST(is_usable(noon - 24h, noon));
    BOOST_TEST(!is_usable(noon - 24h - 1ns, noon));
}

BOOST_AUTO_TEST_CASE(what_is_not_ours_is_refused)
{
    auto const good = core::make_waiting_ticket(mac, ticket());
    BOOST_TEST(read(good).has_value());
    BOOST_TEST(!read(core::make_waiting_ticket(mac_with("Secret"), ticket())));
    for (std::size_t i = 0; i < good.size(); ++i) {
        auto forged = good;
        forged[i] = forged[i] == 'A' ? 'B' : 'A';
        BOOST_TEST(!read(forged), "with another character at " << i);
    }
    for (auto const& bad : {std::string(), std::string("x"), good + "A", good.substr(1), good.substr(1) + "=",
                            std::string(100'000, 'A'), std::string(96, 'A'), std::string(96, '\xff'),
                            good.substr(0, 10) + "\n" + good.substr(11)})
        BOOST_TEST(!read(bad));
}

BOOST_AUTO_TEST_CASE(the_same_secret_serves_for_other_things_too)
{
    std::vector<std::string> messages;
    core::Mac const recording = [&](std::string_view message) {
        messages.emplace_back(message);
        return mac(message);
    };
    core::make_waiting_ticket(recording, ticket());
    core::waiting_group(recording, "203.0.113.7");
    core::make_ticket(recording, "sim.example.org:2000", "16 random bytes.", noon);
    BOOST_TEST(messages.size() == 3u);
    BOOST_TEST(messages.at(0).starts_with("webots_cloud waiting ticket 1\n"));
    BOOST_TEST(messages.at(1).starts_with("webots_cloud waiting group 1\n"));
    BOOST_TEST(messages.at(2).starts_with("webots_cloud ticket 1\n"));
}

BOOST_AUTO_TEST_CASE(a_group_is_named_but_not_told)
{
    auto const group = core::waiting_group(mac, "203.0.113.7");
    BOOST_TEST(group == core::waiting_group(mac, "203.0.113.7"));
    BOOST_TEST(group != core::waiting_group(mac, "203.0.113.8"));
    BOOST_TEST(group != core::waiting_group(mac_with("Secret"), "203.0.113.7"));
    BOOST_TEST(core::waiting_group(mac, "") == "");
}

// So that a home is one group, although it has 256 or 65,536 networks.
BOOST_AUTO_TEST_CASE(names_have_in_common_what_their_networks_have)
{
    auto const levels = [](std::string_view key) {
        std::vector<std::string> names;
        auto const group = core::waiting_group(mac, key);
        for (auto const& level : core::QuotaLevels(group))
            names.emplace_back(level.key);
        return names;
    };
    auto const one = levels("2001:db8:1:200::/64");
    auto const in_56 = levels("2001:db8:1:2ff::/64");
    auto const in_48 = levels("2001:db8:1:300::/64");
    auto const other = levels("2001:db8:2:200::/64");
    BOOST_REQUIRE(one.size() == 3u);
    BOOST_TEST((one[0] != in_56[0] && one[1] == in_56[1] && one[2] == in_56[2]));
    BOOST_TEST((one[0] != in_48[0] && one[1] != in_48[1] && one[2] == in_48[2]));
    BOOST_TEST((one[0] != other[0] && one[1] != other[1] && one[2] != other[2]));
    BOOST_TEST(one[0] != "2001:db8:1:200::/64");
    auto given = ticket();
    given.group = core::waiting_group(mac, "2001:db8:1:200::/64");
    BOOST_TEST(read(core::make_waiting_ticket(mac, given)).value().group == one[0]);
}

BOOST_AUTO_TEST_CASE(one_connection_has_the_place)
{
    WaitingTickets tickets;
    BOOST_TEST(!tickets.enter(id(1), "g", 10));
    BOOST_TEST(!tickets.enter(id(2), "g", 11));
    BOOST_TEST(tickets.is_usable(id(1), noon));
    BOOST_TEST(tickets.enter(id(1), "g", 12).value() == 10u, "its old connection was not known to be dead");
    tickets.serve(id(1), 10, noon);
    BOOST_TEST(tickets.is_usable(id(1), noon), "the old connection has no say");
    tickets.leave(id(1), 10, noon);
    BOOST_TEST(tickets.enter(id(1), "g", 13).value() == 12u);
    BOOST_TEST(tickets.size() == 2u);
}

BOOST_AUTO_TEST_CASE(who_was_served_cannot_come_again)
{
    WaitingTickets tickets;
    tickets.enter(id(1), "g", 10);
    tickets.serve(id(1), 10, noon);
    BOOST_TEST(!tickets.is_usable(id(1), noon));
    BOOST_TEST(!tickets.is_usable(id(1), noon + 80s));
    BOOST_TEST(tickets.is_usable(id(1), noon + 81s), "since the ticket is too old");
    BOOST_TEST(tickets.size() == 0u);
}

BOOST_AUTO_TEST_CASE(who_left_can_come_back_and_counts_until_then)
{
    WaitingTickets tickets;
    for (int i = 1; i <= 3; ++i)
        tickets.enter(id(i), i == 3 ? "h" : "g", 10);
    BOOST_TEST(tickets.away("g", noon) == 0u);
    for (int i = 1; i <= 3; ++i)
        tickets.leave(id(i), 10, noon);
    BOOST_TEST(tickets.away("g", noon) == 2u);
    BOOST_TEST(tickets.away("h", noon) == 1u);
    BOOST_TEST(tickets.is_usable(id(1), noon));
    BOOST_TEST(!tickets.enter(id(1), "g", 11));
    BOOST_TEST(tickets.away("g", noon) == 1u);
    BOOST_TEST(tickets.away("g", noon + 80s) == 1u);
    BOOST_TEST(tickets.away("g", noon + 81s) == 0u);
    BOOST_TEST(tickets.size() == 1u);
}

BOOST_AUTO_TEST_CASE(so_many_are_remembered)
{
    WaitingTickets tickets(3);
    for (int i = 0; i < 10; ++i) {
        tickets.enter(id(i), "g", 10);
        tickets.serve(id(i), 10, noon + i * 1s);
        tickets.enter(id(100 + i), "g", 10);
        tickets.leave(id(100 + i), 10, noon + i * 1s);
    }
    BOOST_TEST(tickets.size() == 6u);
    BOOST_TEST(tickets.away("g", noon + 9s) == 3u);
    BOOST_TEST(tickets.is_usable(id(6), noon + 9s), "forgotten");
    BOOST_TEST(!tickets.is_usable(id(7), noon + 9s));
}

BOOST_AUTO_TEST_SUITE_END()
