#include "unit_test.hpp"

#include "core/access/host_name.hpp"

using webots_cloud::core::ascii_host_name;

BOOST_AUTO_TEST_SUITE(names_of_hosts)

// Of RFC 3492, section 7.1, and names that exist.
BOOST_AUTO_TEST_CASE(letters_beyond_ascii_are_said_as_browsers_say_them)
{
    for (auto const& [name, said] :
         {std::pair("b\u00fccher.example", "xn--bcher-kva.example"),
          std::pair("www.M\u00dcNCHEN.de", "www.xn--mnchen-3ya.de"),
          std::pair("\u4ed6\u4eec\u4e3a\u4ec0\u4e48\u4e0d\u8bf4\u4e2d\u6587.cn",
                    "xn--ihqwcrb4cv8a8dqg056pqjye.cn"),
          std::pair("3\u5e74b\u7d44\u91d1\u516b\u5148\u751f", "xn--3b-ww4c5e180e575a65lsy2b"),
          std::pair("\u00e9cole.\u00e9cole:80", "xn--cole-9oa.xn--cole-9oa:80")})
        BOOST_TEST(ascii_host_name(name) == said, name);
}

BOOST_AUTO_TEST_CASE(other_names_stay_as_they_are)
{
    for (std::string const name :
         {"", ".", "a.b", "sim.example.org:2000", "*.Example.org", "[::1]:80", "caf\xe9.org"})
        BOOST_TEST(ascii_host_name(name) == name, name);
    auto const long_name = std::string(64, 'a') + "\u00fc";
    BOOST_TEST(ascii_host_name(long_name) == long_name);
}

BOOST_AUTO_TEST_SUITE_END()
