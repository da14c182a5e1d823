// git's deltas.
#include "unit_test.hpp"

#include "core/git/git_delta.hpp"

#include <string>

using namespace webots_cloud;
using core::apply_delta;
using namespace std::string_literals;

BOOST_AUTO_TEST_SUITE(git_delta)

BOOST_AUTO_TEST_CASE(a_delta_copies_and_adds)
{
    // base of 10, result of 9: copy 4 bytes from 2, add "XYZ", copy 2 from 0
    auto const delta = "\x0a\x09\x91\x02\x04\x03XYZ\x90\x02"s;
    BOOST_TEST(core::delta_result_size(delta).value() == 9u);
    BOOST_TEST(apply_delta("0123456789", delta).value() == "2345XYZ01");
}

BOOST_AUTO_TEST_CASE(a_copy_of_size_zero_means_65536_bytes)
{
    std::string const base(65536, 'b');
    auto const delta =
        "\x80\x80\x04\x80\x80\x04\x80"s; // both sizes 65536; copy, neither offset nor size given
    BOOST_TEST((apply_delta(base, delta).value() == base));
}

BOOST_AUTO_TEST_CASE(every_cut_of_a_delta_is_an_error)
{
    auto const delta = "\x0a\x09\x91\x02\x04\x03XYZ\x90\x02"s;
    for (std::size_t size = 0; size < delta.size(); ++size)
        BOOST_TEST(apply_delta("0123456789", std::string_view(delta).substr(0, size)).has_error(), size);
}

BOOST_AUTO_TEST_CASE(nothing_beyond_the_base_is_copied)
{
    BOOST_TEST(apply_delta("0123456789", "\x0a\x04\x91\x08\x04"s).has_error());
    BOOST_TEST(apply_delta("0123456789", "\x0a\x01\x91\x0b\x01"s).has_error());
    BOOST_TEST(apply_delta("0123456789", "\x0a\x04\xff\xff\xff\xff\xff\xff\xff\xff"s).has_error());
}

BOOST_AUTO_TEST_CASE(a_result_is_never_larger_than_announced)
{
    BOOST_TEST(apply_delta("0123456789", "\x0a\x02\x03XYZ"s).has_error());
    BOOST_TEST(apply_delta("0123456789", "\x0a\x04\x03XYZ"s).has_error()); // nor smaller
}

BOOST_AUTO_TEST_CASE(a_delta_for_another_base_is_an_error)
{
    BOOST_TEST(apply_delta("012345678", "\x0a\x01\x01X"s).has_error());
}

BOOST_AUTO_TEST_CASE(the_reserved_instruction_and_endless_sizes_are_errors)
{
    BOOST_TEST(apply_delta("0123456789", "\x0a\x01\x00"s).has_error());
    BOOST_TEST(core::delta_result_size("\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01"s).has_error());
    BOOST_TEST(core::delta_result_size(""s).has_error());
}

BOOST_AUTO_TEST_SUITE_END()
