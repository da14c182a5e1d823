#include "core/config/written_quantity.hpp"
#include "unit_test.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(written_quantity)

namespace {

ConfigKey number_key(std::string_view unit, double min = 0, double max = 1e12)
{
    ConfigKey key;
    key.name = "k";
    key.value.type = KeyType::number;
    key.unit = unit;
    key.min = min;
    key.max = max;
    return key;
}

double meant(std::string_view text, std::string_view unit)
{
    return number_meant(text, number_key(unit)).value_or(-1);
}

} // namespace

BOOST_AUTO_TEST_CASE(times_are_counted_in_the_unit_of_the_key)
{
    BOOST_TEST(meant("2h", "seconds") == 7200);
    BOOST_TEST(meant("1.5h", "seconds") == 5400);
    BOOST_TEST(meant("1,5 h", "seconds") == 5400);
    BOOST_TEST(meant("90m", "seconds") == 5400);
    BOOST_TEST(meant("1h 30min", "seconds") == 5400);
    BOOST_TEST(meant("2h30m", "seconds") == 9000);
    BOOST_TEST(meant("500ms", "seconds") == 0.5);
    BOOST_TEST(meant("1 week", "days") == 7);
    BOOST_TEST(meant("12h", "days") == 0.5);
}

BOOST_AUTO_TEST_CASE(sizes_shares_and_rates_too)
{
    BOOST_TEST(meant("4 GB", "megabytes") == 4096);
    BOOST_TEST(meant("4 gib", "megabytes") == 4096);
    BOOST_TEST(meant("512M", "megabytes") == 512, "no minutes");
    BOOST_TEST(meant("1TB", "gigabytes") == 1024);
    BOOST_TEST(meant("50%", "percent") == 50);
    BOOST_TEST(meant("1 MB/s", "bytes per second") == 1 << 20);
    BOOST_TEST(meant("600 per minute", "requests per second") == 10);
}

BOOST_AUTO_TEST_CASE(numbers_without_a_unit_are_those_of_the_key)
{
    BOOST_TEST(meant("2000", "") == 2000);
    BOOST_TEST(meant("1e3", "seconds") == 1000);
    BOOST_TEST(meant("2,5", "seconds") == 2.5);
}

BOOST_AUTO_TEST_CASE(what_may_mean_something_else_means_nothing)
{
    for (auto const* text :
         {"", "h", "two hours", "4 GB", "1:30", "1,000", "1.2.3", "2001-2100", "10 Mbit/s", "1h30"})
        BOOST_TEST(meant(text, "seconds") == -1, text);
    BOOST_TEST(!number_meant("5 s", number_key("", 1, 65535)));
    BOOST_TEST(!number_meant("0.95", number_key("percent", 1, 1000)), "it is below the least");
    auto integer = number_key("");
    integer.value.type = KeyType::integer;
    BOOST_TEST(!number_meant("1.5", integer));
}

BOOST_AUTO_TEST_CASE(a_quantity_has_units_alone)
{
    for (auto const* text : {"2h", "4 GB", "50%", "1h 30min", "10 MB/s"})
        BOOST_TEST(is_quantity(text), text);
    for (auto const* text : {"", "5", "5 6", "h", "5 apples", "127.0.0.1"})
        BOOST_TEST(!is_quantity(text), text);
}

BOOST_AUTO_TEST_SUITE_END()
