#include "unit_test.hpp"

#include "core/base64.hpp"
#include "core/classes/class_messages.hpp"
#include "core/classes/class_pictures.hpp"

#include <string>

using namespace webots_cloud::core;
using namespace std::chrono_literals;

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

BOOST_AUTO_TEST_SUITE(class_pictures)

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

BOOST_AUTO_TEST_CASE(a_picture_is_base64_that_begins_like_a_jpeg)
{
    BOOST_TEST(is_jpeg_in_base64("/9j/AAAA", 100));
    BOOST_TEST(is_jpeg_in_base64("/9j/AAA=", 100));
    BOOST_TEST(is_jpeg_in_base64("/9j/AA==", 100));
    for (auto const* text : {"", "/9j", "AAAA", "/9j/A", "/9j/A===", "/9j/AA<>", "/9j/AA\"x",
                             "/9j/A A=", "/9j/-_AA", "iVBORw0KGgo="})
        BOOST_TEST(!is_jpeg_in_base64(text, 100), text);
}

BOOST_AUTO_TEST_CASE(a_picture_is_not_larger_than_was_asked_for)
{
    std::string jpeg("\xff\xd8\xff");
    jpeg.resize(2800);
    BOOST_TEST(is_jpeg_in_base64(base64(jpeg), 2800));
    jpeg.resize(2803);
    BOOST_TEST(!is_jpeg_in_base64(base64(jpeg), 2800));
}

BOOST_AUTO_TEST_SUITE_END()
