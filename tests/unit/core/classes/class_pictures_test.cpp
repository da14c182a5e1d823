#include "unit_test.hpp"

#include "core/base64.hpp"
#include "core/classes/class_messages.hpp"
#include "core/classes/class_pictures.hpp"
#include "core/text.hpp"

#include <string>
#include <utility>

using namespace webots_cloud::core;
using namespace std::chrono_literals;
using namespace std::string_view_literals;

BOOST_AUTO_TEST_SUITE(class_pictures)

namespace {

/// What pictures of so many students take in a second, with the frames around them.
double bits_per_second(std::size_t students)
{
    auto const terms = picture_terms(students);
    std::string jpeg("\xff\xd8\xff");
    jpeg.resize(terms.bytes);
    auto const message = picture_message(1'000, base64(jpeg));
    constexpr std::size_t frame = 4;
    return static_cast<double>(students * (message.size() + frame) * 8) /
           std::chrono::duration<double>(terms.interval).count();
}

/// The beginning of a JPEG of this size: what is in `before`, and its frame.
std::string jpeg_of(int width, int height, std::string_view before = {}, char frame = '\xc0')
{
    auto const two = [](int number) {
        return std::string{static_cast<char>(number >> 8 & 0xFF), static_cast<char>(number & 0xFF)};
    };
    return concat("\xff\xd8", before, "\xff", std::string(1, frame), two(11), "\x08", two(height), two(width),
                  "\x01\x01\x11", std::string(1, '\0'));
}

/// What is told of so many students who report as often as they may.
double bits_of_states(std::size_t students)
{
    StudentRow row;
    row.id = 1'000;
    row.name = "A student of an average name";
    row.state = StudentState::starting;
    row.time = 1'000'000;
    row.simulator = "wss://simulation.example.org/2000/simulation/abcdefghijklmnopqrstuvwxyzab/2001/";
    return static_cast<double>(students * (student_message(row).size() + 4) * 8 * 2);
}

} // namespace

BOOST_AUTO_TEST_CASE(thirty_students_send_two_pictures_a_second_in_2_mbit_s)
{
    BOOST_TEST(picture_terms(0).interval.count() == 500);
    BOOST_TEST(picture_terms(1).interval.count() == 500);
    BOOST_TEST(picture_terms(30).interval.count() == 500);
    BOOST_TEST(bits_per_second(30) + bits_of_states(30) < 2e6);
}

BOOST_AUTO_TEST_CASE(more_students_send_less_often_and_take_no_more)
{
    auto last = 500ms;
    for (std::size_t students = 1; students <= 200; ++students) {
        auto const interval = picture_terms(students).interval;
        BOOST_TEST(interval.count() >= last.count());
        BOOST_TEST(bits_per_second(students) < 1.9e6);
        last = interval;
    }
    BOOST_TEST(last.count() <= 3500);
}

BOOST_AUTO_TEST_CASE(a_picture_is_base64_of_a_jpeg)
{
    PictureTerms const terms;
    BOOST_TEST(is_picture_in_base64(base64(jpeg_of(160, 120)), terms));
    BOOST_TEST(is_picture_in_base64(base64(jpeg_of(160, 120) + "x"), terms));
    BOOST_TEST(is_picture_in_base64(base64(jpeg_of(160, 120) + "xy"), terms));
    auto const good = base64(jpeg_of(160, 120));
    for (auto const& text :
         {good.substr(1), good + "A===", good + "AA<>", good + "AA\"x", good + "A A=", good + "-_AA"})
        BOOST_TEST(!is_picture_in_base64(text, terms), text);
    for (auto const* text : {"", "/9j", "/9j/", "/9j/AAAA", "AAAA", "iVBORw0KGgo="})
        BOOST_TEST(!is_picture_in_base64(text, terms), text);
}

BOOST_AUTO_TEST_CASE(a_picture_has_no_more_bytes_than_were_asked_for)
{
    PictureTerms const terms;
    auto jpeg = jpeg_of(160, 120);
    jpeg.resize(2800);
    BOOST_TEST(is_picture_in_base64(base64(jpeg), terms));
    jpeg.resize(2803);
    BOOST_TEST(!is_picture_in_base64(base64(jpeg), terms));
}

// A browser would take memory for each pixel, however few bytes there are.
BOOST_AUTO_TEST_CASE(a_picture_has_no_more_pixels_than_were_asked_for)
{
    PictureTerms const terms;
    BOOST_TEST(is_picture_in_base64(base64(jpeg_of(1, 1)), terms));
    for (auto const& [width, height] :
         {std::pair(16'000, 16'000), {161, 120}, {160, 121}, {0, 120}, {160, 0}})
        for (auto const before : {""sv, "\xff\xe0\0\x04JF"sv, "\xff\xdb\0\x03!\xff\xfe\0\x02"sv})
            BOOST_TEST(!is_picture_in_base64(base64(jpeg_of(width, height, before)), terms));
}

BOOST_AUTO_TEST_CASE(the_size_of_a_picture_is_found_behind_its_tables)
{
    PictureTerms const terms;
    auto const shown = [&terms](std::string_view before, char frame = '\xc0') {
        return is_picture_in_base64(base64(jpeg_of(160, 120, before, frame)), terms);
    };
    BOOST_TEST(shown("\xff\xe0\0\x04JF\xff\xdb\0\x03!\xff\xc4\0\x02"sv));
    BOOST_TEST(shown("\xff\xdd\0\x04\0\x01"sv, '\xc2')); // progressive
    for (auto const before :
         {"x"sv, "\xff"sv, "\xff\xff\xff\xff"sv, "\xff\xe0\0\0"sv, "\xff\xe0\0\x01"sv, "\xff\xe0\xff\xff"sv,
          "\xff\xd9"sv, "\xff\xda\0\x02"sv, "\xff\xd8"sv, "\xff\x01"sv, "\0\xe0\0\x02"sv})
        BOOST_TEST(!shown(before));
    // Whatever it is cut off at.
    auto const whole = jpeg_of(160, 120);
    for (std::size_t size = 0; size < 11; ++size)
        BOOST_TEST(!is_picture_in_base64(base64(whole.substr(0, size)), terms));
}

BOOST_AUTO_TEST_SUITE_END()
