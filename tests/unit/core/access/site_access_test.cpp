#include "core/access/site_access.hpp"
#include "core/text.hpp"
#include "unit_test.hpp"

using namespace webots_cloud;
using core::Reach;
using core::SiteAccess;

BOOST_AUTO_TEST_SUITE(site_access)

namespace {

SiteAccess local(std::vector<std::string> const& names = {})
{
    return SiteAccess(Reach::this_machine, names, nullptr);
}

SiteAccess with_origins(Reach reach, std::vector<std::string> const& origins)
{
    return SiteAccess(reach, {"sim.example.org"}, &origins);
}

} // namespace

BOOST_AUTO_TEST_CASE(the_name_of_a_server_says_how_far_it_reaches)
{
    for (auto const* host : {"localhost", "LOCALHOST:2000", "localhost.", "sub.localhost", "127.0.0.1",
                             "127.9.9.9:80", "[::1]", "[::1]:2000", "0.0.0.0", "[::]", "[::ffff:127.0.0.1]"})
        BOOST_TEST((core::reach_of(host) == Reach::this_machine), host);
    for (auto const* host : {"pc7", "pc7:2000", "pc7.local", "PC7.LAN", "10.1.2.3", "172.16.0.1",
                             "172.31.255.255", "192.168.1.5:2000", "169.254.1.1", "[fd00::1]", "[fe80::1]",
                             "[::ffff:10.0.0.1]", "lab.home.arpa", "a.b.internal"})
        BOOST_TEST((core::reach_of(host) == Reach::private_network), host);
    for (auto const* host : {"sim.example.org", "8.8.8.8", "172.32.0.1", "192.169.0.1", "[2001:db8::1]", "",
                             "localhost.example.org", "mylocal.org", "a b"})
        BOOST_TEST((core::reach_of(host) == Reach::everybody), host);
}

BOOST_AUTO_TEST_CASE(a_rebound_name_is_not_ours)
{
    auto const access = local({"teacher-pc", "teacher-pc.local", "Sim.Example.org:443"});
    for (auto const* host :
         {"", "localhost", "localhost:1999", "127.0.0.1:2000", "[::1]:2000", "192.168.1.5:2000", "8.8.8.8",
          "Teacher-PC:2000", "teacher-pc.local", "sim.example.org", "sim.example.org."})
        BOOST_TEST(access.knows_host(host), host);
    for (auto const* host :
         {"evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "evil.example:2000",
          "teacher-pc.evil.example", "user@localhost", "local host", "localhost:x", "0x7f.1"})
        BOOST_TEST(!access.knows_host(host), host);
}

BOOST_AUTO_TEST_CASE(what_was_accepted_before_lets_nothing_else_in)
{
    auto const access = local({"pc7"});
    for (int i = 0; i < 2; ++i) {
        BOOST_TEST(access.knows_host("pc7:2000"));
        BOOST_TEST(!access.knows_host("pc7:2000.evil.example"));
        BOOST_TEST(!access.knows_host("evil.example"));
        BOOST_TEST(access.accepts_origin("http://10.0.0.7:2000", "10.0.0.7:2000")); // its own page
        BOOST_TEST(!access.accepts_origin("http://10.0.0.7:2000", "pc7:2000"));
        BOOST_TEST(!access.accepts_origin("http://10.0.0.8:2000", "10.0.0.7:2000"));
        BOOST_TEST(!access.accepts_origin("https://evil.example", "10.0.0.7:2000"));
    }
}

BOOST_AUTO_TEST_CASE(a_server_without_a_name_has_every_name_of_its_network)
{
    SiteAccess const access(core::reach_of("*"), {"*"}, nullptr);
    for (auto const* host : {"192.168.1.5:1999", "pc7", "pc7.local:1999", "localhost"}) {
        BOOST_TEST(access.knows_host(host), host);
        BOOST_TEST(access.accepts_origin(core::concat("http://", host), host), host);
    }
    BOOST_TEST(!access.knows_host("evil.example"));
    BOOST_TEST(!access.accepts_origin("http://evil.example", "evil.example"));
    BOOST_TEST(!access.accepts_origin("http://printer.local", "pc7.local"));
    BOOST_TEST(!SiteAccess(Reach::private_network, {"pc7"}, nullptr).accepts_origin("http://pc8", "pc8"));
}

BOOST_AUTO_TEST_CASE(only_a_server_of_this_machine_checks_the_host_of_every_request)
{
    BOOST_TEST(local().checks_hosts());
    BOOST_TEST(!SiteAccess(Reach::private_network, {}, nullptr).checks_hosts());
    BOOST_TEST(!SiteAccess(Reach::everybody, {}, nullptr).checks_hosts());
    BOOST_TEST(!SiteAccess().checks_hosts());
}

BOOST_AUTO_TEST_CASE(pages_of_the_internet_may_not_use_a_server_of_this_machine)
{
    auto const access = local({"teacher-pc"});
    for (auto const* origin : {"", "http://localhost:1999", "https://localhost", "http://127.0.0.1:1999",
                               "http://[::1]:1999", "http://teacher-pc:1999", "https://webots.cloud",
                               "https://webots.cloud:443", "HTTPS://WEBOTS.CLOUD"})
        BOOST_TEST(access.accepts_origin(origin, "localhost:2000"), origin);
    for (auto const* origin :
         {"null", "https://evil.example", "http://webots.cloud", "https://webots.cloud.evil.example",
          "https://evil.example/?https://webots.cloud", "https://webots.cloud:8443", "file://",
          "chrome-extension://abcdef", "localhost", "http://", "https://localhost@evil.example",
          "http://192.168.1.5:1999"})
        BOOST_TEST(!access.accepts_origin(origin, "localhost:2000"), origin);
}

BOOST_AUTO_TEST_CASE(a_page_of_the_same_address_is_our_own)
{
    SiteAccess const access(Reach::private_network, {"192.168.1.5"}, nullptr);
    BOOST_TEST(access.accepts_origin("http://192.168.1.5:1999", "192.168.1.5:2000"));
    BOOST_TEST(local().accepts_origin("http://10.0.0.7:1999", "10.0.0.7:2000"));
    BOOST_TEST(local().accepts_origin("http://[fd00::1]:1999", "[fd00::1]:2000"));
    BOOST_TEST(!local().accepts_origin("http://evil.example:1999", "evil.example:2000"), "a rebound name");
    BOOST_TEST(!access.accepts_origin("http://192.168.1.6:1999", "192.168.1.5:2000"));
}

BOOST_AUTO_TEST_CASE(a_public_site_takes_every_page_unless_it_says_which)
{
    SiteAccess const open(Reach::everybody, {"sim.example.org"}, nullptr);
    for (auto const* origin : {"null", "https://anybody.example", "http://localhost:8080"})
        BOOST_TEST(open.accepts_origin(origin, "sim.example.org"), origin);
    auto const closed =
        with_origins(Reach::everybody, {"https://Course.Example.edu", "https://*.school.example"});
    for (auto const* origin :
         {"https://course.example.edu", "https://course.example.edu:443", "https://a.school.example",
          "https://a.b.school.example", "https://sim.example.org", "http://sim.example.org:1999"})
        BOOST_TEST(closed.accepts_origin(origin, "sim.example.org"), origin);
    for (auto const* origin :
         {"https://anybody.example", "https://school.example", "https://.school.example.evil",
          "http://a.school.example", "https://evilschool.example", "null", "http://localhost:1999",
          "https://webots.cloud"})
        BOOST_TEST(!closed.accepts_origin(origin, "sim.example.org"), origin);
}

BOOST_AUTO_TEST_CASE(a_page_of_ours_comes_from_the_host_that_it_asks_to_the_port)
{
    SiteAccess const site(Reach::everybody, {"sim.example.org"}, nullptr);
    BOOST_TEST(site.is_own_page("", "anything.example"));
    BOOST_TEST(site.is_own_page("https://sim.example.org", "Sim.Example.org"));
    BOOST_TEST(site.is_own_page("http://localhost:8080", "localhost:8080"));
    BOOST_TEST(site.is_own_page("http://[::1]:8080", "[::1]:8080"));
    for (auto const& [origin, host] :
         {std::pair("null", "sim.example.org"), std::pair("null", "null"),
          std::pair("https://sim.example.org", ""),
          std::pair("https://sim.example.org:444", "sim.example.org"),
          std::pair("http://localhost:2001", "localhost:8080"),
          std::pair("http://evil.example", "evil.example"), std::pair("sim.example.org", "sim.example.org")})
        BOOST_TEST(!site.is_own_page(origin, host), origin << " asks " << host);
    BOOST_TEST(site.has_own_name("https://sim.example.org:444"));
    BOOST_TEST(!site.has_own_name("https://evil.example"));
    BOOST_TEST(!site.has_own_name("null"));
}

BOOST_AUTO_TEST_CASE(everybody_and_pages_without_an_origin_are_let_in_by_name)
{
    BOOST_TEST(with_origins(Reach::this_machine, {"*"}).accepts_origin("https://evil.example", "localhost"));
    BOOST_TEST(with_origins(Reach::this_machine, {"null"}).accepts_origin("null", "localhost"));
    BOOST_TEST(
        !with_origins(Reach::this_machine, {"null"}).accepts_origin("https://webots.cloud", "localhost"));
    BOOST_TEST(!with_origins(Reach::this_machine, {}).accepts_origin("https://webots.cloud", "localhost"));
}

BOOST_AUTO_TEST_CASE(a_configuration_names_origins_and_nothing_else)
{
    for (auto const* origin :
         {"*", "null", "https://example.org", "http://pc7:8080", "https://*.example.org"})
        BOOST_TEST(core::is_origin_pattern(origin), origin);
    for (auto const* origin : {"", "example.org", "https://", "https://*", "https://a.*.org", "://x",
                               "https://a/b", "https://a b", "https://example.org/", "https://*.a.*"})
        BOOST_TEST(!core::is_origin_pattern(origin), origin);
}

BOOST_AUTO_TEST_CASE(frames_may_be_where_web_sockets_may)
{
    BOOST_TEST(SiteAccess().frame_ancestors() == "*");
    BOOST_TEST(local().frame_ancestors() == "'self' https://webots.cloud");
    BOOST_TEST(with_origins(Reach::everybody, {"null", "https://a.example"}).frame_ancestors() ==
               "'self' https://a.example");
}

BOOST_AUTO_TEST_SUITE_END()
