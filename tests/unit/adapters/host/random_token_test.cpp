#include "unit_test.hpp"

#include "core/simulation/gateway_address.hpp"

#include <webots_cloud/adapters.hpp>

#include <set>
#include <string>

using namespace webots_cloud;

BOOST_AUTO_TEST_SUITE(random_token)

BOOST_AUTO_TEST_CASE(tokens_are_long_and_never_the_same)
{
    std::set<std::string> seen;
    for (int i = 0; i < 1000; ++i) {
        auto const token = make_token();
        BOOST_TEST(token.size() == 32u);
        BOOST_TEST(token.find_first_not_of("0123456789abcdef") == std::string::npos);
        seen.insert(token);
    }
    BOOST_TEST(seen.size() == 1000u);
}

BOOST_AUTO_TEST_CASE(tokens_in_addresses_are_letters_alone_and_use_all_of_them)
{
    std::set<std::string> seen;
    std::set<char> letters;
    for (int i = 0; i < 1000; ++i) {
        auto const token = make_address_token();
        BOOST_TEST(token.size() == 28u);
        BOOST_TEST(core::is_gateway_token(token));
        letters.insert(token.begin(), token.end());
        seen.insert(token);
    }
    BOOST_TEST(seen.size() == 1000u);
    BOOST_TEST(letters.size() == 26u);
}

BOOST_AUTO_TEST_SUITE_END()
