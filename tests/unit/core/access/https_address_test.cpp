#include "unit_test.hpp"

#include "core/access/https_address.hpp"

using namespace webots_cloud;
using core::challenge_in;
using core::https_address;
using core::Reach;
using core::SiteAccess;

BOOST_AUTO_TEST_SUITE(redirects_to_https)

BOOST_AUTO_TEST_CASE(the_same_address_is_found_by_https)
{
    SiteAccess const site(Reach::everybody, {"sim.example.org", "www.example.org"}, nullptr);
    auto const address = [&site](std::string_view host, std::uint16_t port,
                                 std::string_view target = "/a?b=c") {
        return https_address(host, site, "sim.example.org", port, target);
    };
    BOOST_TEST(address("sim.example.org", 443) == "https://sim.example.org/a?b=c");
    BOOST_TEST(address("sim.example.org:80", 443) == "https://sim.example.org/a?b=c");
    BOOST_TEST(address("www.example.org:8080", 1999) == "https://www.example.org:1999/a?b=c");
    BOOST_TEST(address("127.0.0.1:8080", 1999) == "https://127.0.0.1:1999/a?b=c");
    BOOST_TEST(address("[::1]", 443) == "https://[::1]/a?b=c");
    BOOST_TEST(address("sim.example.org", 443, "//evil.example.com/") ==
               "https://sim.example.org//evil.example.com/");
    BOOST_TEST(https_address("sim.example.org", site, "sim.example.org:8443", 443, "/") ==
               "https://sim.example.org:8443/");
}

BOOST_AUTO_TEST_CASE(nobody_is_sent_to_a_foreign_name)
{
    SiteAccess const site(Reach::everybody, {"sim.example.org"}, nullptr);
    for (auto const* host :
         {"", "evil.example.com", "evil.example.com:80", "sim.example.org@evil.example.com", "a b"})
        BOOST_TEST(https_address(host, site, "sim.example.org", 443, "/x") == "https://sim.example.org/x",
                   host);
    BOOST_TEST(https_address("evil.example.com", site, "", 443, "x") == "https://localhost/x");
}

BOOST_AUTO_TEST_CASE(challenges_are_plain_names)
{
    BOOST_TEST(challenge_in("/.well-known/acme-challenge/aB3_-x") == "aB3_-x");
    for (auto const* other : {"/.well-known/acme-challenge/", "/.well-known/acme-challenge/../key.pem",
                              "/.well-known/acme-challenge/a/b", "/.well-known/acme-challenge/a.pem",
                              "/.well-known/acme-challenge/%2e%2e", "/acme-challenge/a", "/"})
        BOOST_TEST(challenge_in(other) == "", other);
    BOOST_TEST(challenge_in("/.well-known/acme-challenge/" + std::string(201, 'a')) == "");
}

BOOST_AUTO_TEST_SUITE_END()
