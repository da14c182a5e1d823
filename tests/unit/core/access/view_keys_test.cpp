#include "unit_test.hpp"

#include "core/access/view_keys.hpp"

using namespace webots_cloud;
using core::ViewKeys;

BOOST_AUTO_TEST_SUITE(view_keys)

BOOST_AUTO_TEST_CASE(a_key_is_told_for_a_while_and_good_for_one_more)
{
    int made = 0;
    ViewKeys keys([&made] { return std::string("key") + std::to_string(++made); });
    TimePoint const start{};
    auto const almost = ViewKeys::lifetime - std::chrono::seconds(1);
    BOOST_TEST(!keys.knows("key1", start), "nobody has been told it");
    BOOST_TEST(keys.current(start) == "key1");
    BOOST_TEST(keys.current(start + almost) == "key1");
    BOOST_TEST(keys.knows("key1", start + almost));
    BOOST_TEST(keys.current(start + ViewKeys::lifetime) == "key2");
    BOOST_TEST(keys.knows("key1", start + ViewKeys::lifetime + almost));
    BOOST_TEST(keys.knows("key2", start + ViewKeys::lifetime + almost));
    BOOST_TEST(!keys.knows("key1", start + 2 * ViewKeys::lifetime));
    BOOST_TEST(keys.knows("key2", start + 2 * ViewKeys::lifetime));
    BOOST_TEST(keys.current(start + 2 * ViewKeys::lifetime) == "key3");
    for (auto const* wrong : {"", "key", "key4", "key33"})
        BOOST_TEST(!keys.knows(wrong, start + 2 * ViewKeys::lifetime), wrong);
    BOOST_TEST(!keys.knows("key3", start + 4 * ViewKeys::lifetime), "nobody has asked for another one");
}

BOOST_AUTO_TEST_CASE(without_random_words_there_are_none)
{
    ViewKeys keys({});
    BOOST_TEST(keys.current(TimePoint()) == "");
    BOOST_TEST(!keys.knows("", TimePoint()));
}

BOOST_AUTO_TEST_SUITE_END()
