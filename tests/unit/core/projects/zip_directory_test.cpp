#include "unit_test.hpp"

#include "core/projects/zip_directory.hpp"

using namespace webots_cloud;
using core::check_zip_directory;

BOOST_AUTO_TEST_SUITE(zip_directory)

namespace {

std::string number(std::uint64_t value, int bytes)
{
    std::string text;
    for (int i = 0; i < bytes; ++i)
        text += static_cast<char>(value >> (8 * i));
    return text;
}

/// The last record of a zip whose list of `entries` has `length` bytes and begins at `offset`.
std::string end_record(std::uint64_t entries, std::uint64_t length, std::uint64_t offset,
                       std::string const& comment = {})
{
    return "PK\5\6" + number(0, 4) + number(entries, 2) + number(entries, 2) + number(length, 4) +
           number(offset, 4) + number(comment.size(), 2) + comment;
}

/// The records that zip64 puts in front of it; `at`: where they begin.
std::string large_end_records(std::uint64_t entries, std::uint64_t length, std::uint64_t offset,
                              std::uint64_t at)
{
    return "PK\6\6" + number(44, 8) + number(45, 2) + number(45, 2) + number(0, 8) + number(entries, 8) +
           number(entries, 8) + number(length, 8) + number(offset, 8) + "PK\6\7" + number(0, 4) +
           number(at, 8) + number(1, 4);
}

result<> check(std::string const& file, std::uint32_t max_entries = 100)
{
    return check_zip_directory(file, file.size(), max_entries);
}

} // namespace

BOOST_AUTO_TEST_CASE(a_list_right_before_the_end_is_accepted)
{
    BOOST_TEST(check(end_record(0, 0, 0)).has_value());
    BOOST_TEST(check(std::string(500, 'x') + end_record(3, 200, 300)).has_value());
    BOOST_TEST(check(std::string(500, 'x') + end_record(3, 200, 300, "a comment")).has_value());
    auto const tail = end_record(3, 200, 9'000'000);
    BOOST_TEST(check_zip_directory(tail, 9'000'200 + tail.size(), 100).has_value());
}

BOOST_AUTO_TEST_CASE(what_has_no_end_is_no_zip)
{
    for (std::string const& file : {std::string(), std::string("hello"), std::string(21, 'P'),
                                    std::string(1000, '\0'), end_record(0, 0, 0).substr(0, 21)})
        BOOST_TEST(check(file).error().message() == "Bad ZIP file: it has no end, or is something else.");
}

BOOST_AUTO_TEST_CASE(a_list_elsewhere_is_refused)
{
    for (auto const& end :
         {end_record(3, 200, 299), end_record(3, 200, 301), end_record(3, 0xFFFFFFFF, 0xFFFFFFFF)})
        BOOST_TEST(check(std::string(500, 'x') + end).error().message() ==
                   "Bad ZIP file: its list of files is not where it should be.");
}

BOOST_AUTO_TEST_CASE(ends_in_large_numbers_are_understood)
{
    std::string const list(500, 'x');
    auto const large = large_end_records(3, 200, 300, 500);
    BOOST_TEST(check(list + large + end_record(3, 200, 300)).has_value());
    BOOST_TEST(check(list + large + end_record(0xFFFF, 0xFFFFFFFF, 0xFFFFFFFF)).has_value());
    auto const beyond = std::uint64_t{5} << 30;
    auto const tail = large_end_records(3, 200, beyond - 200, beyond) + end_record(3, 200, 0xFFFFFFFF);
    BOOST_TEST(check_zip_directory(tail, beyond + tail.size(), 100).has_value());
    BOOST_TEST((check(list + large_end_records(101, 200, 300, 500) + end_record(0xFFFF, 200, 300)).error() ==
                errc::too_large));
}

BOOST_AUTO_TEST_CASE(two_ends_that_do_not_agree_are_refused)
{
    std::string const list(500, 'x');
    auto const large = large_end_records(3, 200, 300, 500);
    for (auto const& end : {end_record(4, 200, 300), end_record(3, 201, 300), end_record(3, 200, 299)})
        BOOST_TEST(check(list + large + end).error().message() ==
                   "Bad ZIP file: it has two ends that contradict each other.");
    for (auto const& file : {list + large_end_records(3, 200, 300, 499), list.substr(1) + large,
                             list + large.substr(1), large.substr(56), large.substr(40), large})
        BOOST_TEST(check(file + end_record(3, 200, 300)).error().message() ==
                   "Bad ZIP file: its end is not where it should be.");
    for (auto const& wrong : {large_end_records(3, 200, 301, 500), large_end_records(3, 201, 300, 500),
                              large_end_records(3, ~std::uint64_t{0}, 300, 500)})
        BOOST_TEST(check(list + wrong + end_record(3, 0xFFFFFFFF, 0xFFFFFFFF)).has_error());
}

BOOST_AUTO_TEST_CASE(parts_of_archives_are_refused)
{
    auto file = end_record(0, 0, 0);
    file[4] = 1;
    BOOST_TEST((check(file).error() == errc::protocol_error));
    file = end_record(0, 0, 0);
    file[8] = 1;
    BOOST_TEST((check(file).error() == errc::protocol_error));
}

BOOST_AUTO_TEST_CASE(lists_that_are_too_long_to_be_taken_into_memory_are_refused)
{
    std::string const list(60'000, 'x');
    BOOST_TEST(check(list + end_record(100, 200, 59'800)).has_value());
    BOOST_TEST((check(list + end_record(101, 200, 59'800)).error() == errc::too_large));
    BOOST_TEST((check(list + end_record(1, 60'000, 0)).error() ==
                errc::too_large)); // it does not say how many they are
}

BOOST_AUTO_TEST_SUITE_END()
