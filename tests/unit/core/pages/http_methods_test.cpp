#include "unit_test.hpp"

#include "core/pages/http_methods.hpp"

#include <string>

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(http_methods)

namespace {

/// Those of the methods of HTTP that are permitted.
std::string permitted(Methods methods)
{
    std::string names;
    for (auto const* name :
         {"GET", "HEAD", "OPTIONS", "POST", "PUT", "DELETE", "PATCH", "get", "GE", "GET, HEAD", ", ", ""})
        if (permits(methods, name))
            names += (names.empty() ? "" : ", ") + std::string(name);
    return names;
}

} // namespace

BOOST_AUTO_TEST_CASE(what_allow_names_is_what_is_permitted)
{
    BOOST_TEST(allow_header(Methods::get) == "GET");
    BOOST_TEST(allow_header(Methods::read) == "GET, HEAD");
    BOOST_TEST(allow_header(Methods::read_and_options) == "GET, HEAD, OPTIONS");
    BOOST_TEST(allow_header(Methods::post) == "POST");
    for (auto const methods : {Methods::get, Methods::read, Methods::read_and_options, Methods::post})
        BOOST_TEST(permitted(methods) == allow_header(methods));
}

BOOST_AUTO_TEST_SUITE_END()
