#include "unit_test.hpp"

#include "core/access/tickets.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;
using core::TicketBook;

BOOST_TEST_DONT_PRINT_LOG_VALUE(webots_cloud::core::TicketVerdict)

BOOST_AUTO_TEST_SUITE(tickets)

using Verdict = core::TicketVerdict;

namespace {

constexpr WallTime noon{std::chrono::hours(400'000)};
constexpr std::string_view server = "sim.example.org/2000";

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

std::string nonce(int number)
{
    std::string text = std::to_string(number);
    text.resize(core::ticket_nonce_size, '\xff');
    return text;
}

std::string ticket(int number = 0, std::string_view to = server, WallTime when = noon)
{
    return core::make_ticket(mac_with("secret"), to, nonce(number), when);
}

TicketBook book(std::size_t max_used = 100)
{
    return TicketBook(mac_with("secret"), {"sim.example.org:2000", "Lab7:2000"}, max_used);
}

} // namespace

BOOST_AUTO_TEST_CASE(a_ticket_is_accepted_once)
{
    auto used = book();
    BOOST_TEST(used.redeem(ticket(1), noon) == Verdict::accepted);
    BOOST_TEST(used.redeem(ticket(1), noon) == Verdict::used);
    BOOST_TEST(used.redeem(ticket(1), noon + 59s) == Verdict::used);
    BOOST_TEST(used.redeem(ticket(2), noon) == Verdict::accepted);
    BOOST_TEST(ticket(1) != ticket(2));
}

BOOST_AUTO_TEST_CASE(it_is_valid_for_a_minute)
{
    auto used = book();
    BOOST_TEST(used.redeem(ticket(1), noon + 60s) == Verdict::accepted);
    BOOST_TEST(used.redeem(ticket(2), noon + 61s) == Verdict::expired);
    BOOST_TEST(used.redeem(ticket(3), noon - 5min) == Verdict::accepted, "another machine's clock");
    BOOST_TEST(used.redeem(ticket(4), noon - 6min) == Verdict::expired);
}

BOOST_AUTO_TEST_CASE(those_of_other_servers_and_other_secrets_are_unknown)
{
    auto used = book();
    BOOST_TEST(used.redeem(ticket(1, "sim.example.org/3000"), noon) == Verdict::unknown);
    BOOST_TEST(used.redeem(ticket(1, "sim.example.com/2000"), noon) == Verdict::unknown);
    BOOST_TEST(used.redeem(core::make_ticket(mac_with("Secret"), server, nonce(1), noon), noon) ==
               Verdict::unknown);
    BOOST_TEST(used.redeem(ticket(2, "SIM.example.org:2000"), noon) == Verdict::accepted);
    BOOST_TEST(used.redeem(ticket(3, "lab7/2000"), noon) == Verdict::accepted);
}

BOOST_AUTO_TEST_CASE(a_ticket_with_any_other_character_is_unknown)
{
    auto used = book();
    auto const good = ticket(1);
    BOOST_TEST(good.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_") ==
               std::string::npos);
    for (std::size_t i = 0; i + 1 < good.size(); ++i) { // of the last one not every bit counts
        auto forged = good;
        forged[i] = forged[i] == 'A' ? 'B' : 'A';
        BOOST_TEST(used.redeem(forged, noon) == Verdict::unknown);
    }
    for (auto const& bad : {std::string("x"), good + "A", good.substr(1), good + "=",
                            std::string(100'000, 'A'), good.substr(0, 10) + "\n" + good.substr(11)})
        BOOST_TEST(used.redeem(bad, noon) == Verdict::unknown);
    BOOST_TEST(used.redeem("", noon) == Verdict::missing);
    BOOST_TEST(used.redeem(good, noon) == Verdict::accepted);
}

BOOST_AUTO_TEST_CASE(used_tickets_are_remembered_until_they_expire_and_no_more_than_fit)
{
    auto used = book(3);
    for (int i = 0; i < 3; ++i)
        BOOST_TEST(used.redeem(ticket(i), noon) == Verdict::accepted);
    BOOST_TEST(used.redeem(ticket(3), noon) == Verdict::too_many);
    BOOST_TEST(used.redeem(ticket(4, server, noon + 61s), noon + 61s) == Verdict::accepted);
    BOOST_TEST(used.size() == 1u);
}

BOOST_AUTO_TEST_CASE(the_ticket_stands_in_the_path_of_client)
{
    BOOST_TEST(core::ticket_in("/ticket/abc/client") == "abc");
    BOOST_TEST(core::ticket_in("/ticket/abc/worlds/list") == "abc");
    for (auto const* other : {"/client", "/ticket//client", "/ticket/client", "/ticket/a/b/client",
                              "/ticket/a/load", "/ticket/a", "/tickets/a/client"})
        BOOST_TEST(core::ticket_in(other) == "", other);
}

BOOST_AUTO_TEST_CASE(whoever_is_refused_is_told_why)
{
    BOOST_TEST(!core::refusal(Verdict::accepted));
    for (auto const verdict :
         {Verdict::missing, Verdict::unknown, Verdict::expired, Verdict::used, Verdict::too_many})
        BOOST_TEST(core::refusal(verdict)->message().ends_with("."));
}

BOOST_AUTO_TEST_SUITE_END()
