#include "unit_test.hpp"

#include "core/simulation/first_picture.hpp"
#include "core/text.hpp"

using namespace webots_cloud;
using core::concat;
using State = core::FirstPicture::State;

BOOST_AUTO_TEST_SUITE(first_picture)

namespace {

constexpr std::string_view head = "HTTP/1.0 200 OK\r\nServer: Webots\r\nContent-Type: "
                                  "multipart/x-mixed-replace; boundary=WebotsFrame\r\n\r\n";

std::string jpeg(std::size_t size)
{
    return concat("\xff\xd8\xff", std::string(size - 3, 'x'));
}

std::string part(std::string_view bytes)
{
    return concat("--WebotsFrame\r\nContent-Type: image/jpeg\r\nContent-Length: ",
                  std::to_string(bytes.size()), "\r\n\r\n", bytes, "\r\n");
}

} // namespace

BOOST_AUTO_TEST_CASE(the_first_picture_of_a_stream_is_found_as_soon_as_it_is_whole)
{
    auto const picture = jpeg(3000);
    auto const answer = concat(head, part(picture), part(jpeg(100)));
    auto const needed = head.size() + part(picture).size() - 2;
    for (std::size_t size = 0; size < needed; ++size)
        BOOST_TEST_REQUIRE(
            (core::first_picture(std::string_view(answer).substr(0, size)).state == State::incomplete));
    for (auto const size : {needed, answer.size()}) {
        auto const found = core::first_picture(std::string_view(answer).substr(0, size));
        BOOST_TEST((found.state == State::found));
        BOOST_TEST(found.picture == picture);
    }
}

BOOST_AUTO_TEST_CASE(what_is_no_stream_of_pictures_has_none)
{
    for (auto const& answer :
         {std::string("HTTP/1.1 404 Not Found\r\nContent-Type: multipart/x\r\n\r\n"),
          std::string("HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n"),
          std::string("HTTP/1.1 200 OK\r\nContent-Type: multipart/x\r\nTransfer-Encoding: chunked\r\n\r\n"),
          std::string(10'000, 'x'), concat(head, std::string(10'000, 'x')),
          concat(head, "--WebotsFrame\r\nContent-Type: image/jpeg\r\n\r\n"),
          concat(head, "--WebotsFrame\r\nContent-Length: -1\r\n\r\n"),
          concat(head, "--WebotsFrame\r\nContent-Length: 99999999999999999999\r\n\r\n"),
          concat(head, "--WebotsFrame\r\nContent-Length: 300000\r\n\r\n"), concat(head, part("<svg></svg>"))})
        BOOST_TEST((core::first_picture(answer).state == State::none), answer.substr(0, 200));
}

BOOST_AUTO_TEST_CASE(a_picture_is_a_jpeg_of_not_too_many_bytes)
{
    BOOST_TEST(core::is_world_picture(jpeg(core::max_world_picture)));
    BOOST_TEST(!core::is_world_picture(jpeg(core::max_world_picture + 1)));
    BOOST_TEST(!core::is_world_picture("<html>"));
    BOOST_TEST(!core::is_world_picture(""));
}

BOOST_AUTO_TEST_SUITE_END()
