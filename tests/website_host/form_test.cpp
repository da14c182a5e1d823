#include "unit_test.hpp"

#include "form.hpp"

using namespace website_host;

namespace {

std::string const multipart = "multipart/form-data; boundary=b";

std::string part(std::string const& disposition, std::string const& content)
{
    return "--b\r\nContent-Disposition: " + disposition + "\r\n\r\n" + content + "\r\n";
}

} // namespace

BOOST_AUTO_TEST_SUITE(form)

BOOST_AUTO_TEST_CASE(urlencoded_fields_are_decoded)
{
    auto const form = parse_form("application/x-www-form-urlencoded; charset=UTF-8",
                                 "key=a+b%26c%3D&project=robots&empty=&alone&%C3%A9=%zz%4&key2==&&")
                          .value();
    BOOST_TEST(form.size() == 6u);
    BOOST_TEST(form.at("key") == "a b&c=");
    BOOST_TEST(form.at("project") == "robots");
    BOOST_TEST(form.at("empty") == "");
    BOOST_TEST(form.at("alone") == "");
    BOOST_TEST(form.at("\xc3\xa9") == "%zz%4");
    BOOST_TEST(form.at("key2") == "=");
    BOOST_TEST(parse_form("", "a=1&a=2").value().at("a") == "2");
    BOOST_TEST(parse_form("", "").value().empty());
}

BOOST_AUTO_TEST_CASE(parts_are_taken_as_they_are)
{
    std::string const content =
        "line 1\r\nline 2\n--b is not at the start of a line--\r\n--\r\n-- b\0\xff+%41";
    auto const body = "a preamble\r\n" + part("form-data; name=\"content\"", content) +
                      part("FORM-DATA; filename=\"a;name=b\"; name=\"with %22quotes%22 and \\\\\"", "x") +
                      part("form-data; name=plain", "") + "--b--\r\nan epilogue";
    for (auto const* const type :
         {"multipart/form-data; boundary=b", "Multipart/Form-Data;charset=utf-8 ; Boundary=\"b\""}) {
        auto const form = parse_form(type, body).value();
        BOOST_TEST(form.size() == 3u);
        BOOST_TEST(form.at("content") == content);
        BOOST_TEST(form.at("with \"quotes\" and \\") == "x");
        BOOST_TEST(form.at("plain") == "");
    }
    BOOST_TEST(parse_form(multipart, "--b--").value().empty());
}

BOOST_AUTO_TEST_CASE(what_can_not_be_understood_is_refused)
{
    auto const good = part("form-data; name=a", "x");
    for (auto const& body :
         {std::string(), good, good + "--b", good + "--b-", std::string("--b\r\n"),
          part("attachment; name=a", "x") + "--b--", part("form-data", "x") + "--b--",
          part("form-data; name=\"a", "x") + "--b--", part("form-data; name=\"\"", "x") + "--b--",
          std::string("--b\r\n\r\nx\r\n--b--"),
          part("form-data; name=" + std::string(101, 'n'), "x") + "--b--"})
        BOOST_TEST((parse_form(multipart, body).error() == webots_cloud::errc::invalid_argument), body);
    for (auto const& type :
         {std::string("multipart/form-data"), std::string("multipart/form-data; boundary="),
          std::string("multipart/form-data; boundary=\"b"), std::string("text/plain"),
          "multipart/form-data; boundary=" + std::string(71, 'b')})
        BOOST_TEST((parse_form(type, good + "--b--").error() == webots_cloud::errc::invalid_argument), type);
}

BOOST_AUTO_TEST_CASE(there_are_not_more_fields_than_anybody_needs)
{
    std::string encoded;
    std::string parts;
    for (int i = 0; i < 33; ++i) {
        BOOST_TEST(parse_form("", encoded).has_value());
        BOOST_TEST(parse_form(multipart, parts + "--b--").has_value());
        encoded += "f" + std::to_string(i) + "=1&";
        parts += part("form-data; name=f" + std::to_string(i), "1");
    }
    BOOST_TEST(!parse_form("", encoded).has_value());
    BOOST_TEST(!parse_form(multipart, parts + "--b--").has_value());
}

BOOST_AUTO_TEST_SUITE_END()
