#include "unit_test.hpp"

#include "core/config/session_files.hpp"

#include <algorithm>

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(session_files)

namespace {

bool has(std::vector<std::filesystem::path> const& paths, std::filesystem::path const& path)
{
    return std::find(paths.begin(), paths.end(), path) != paths.end();
}

} // namespace

BOOST_AUTO_TEST_CASE(what_may_be_renewed_is_reached_by_its_folder)
{
    SessionConfig config;
    config.log_dir = "/var/log/webots";
    config.network.ssl_certificate = "/certs/live/cert.pem";
    config.network.ssl_key = "/keys/key.pem";
    config.access.operator_token_file = "/srv/token";
    config.access.session_secret = "/secrets/session";
    config.network.challenge_folder = "/var/www/acme";
    config.http_client.authorities = "/authorities/campus.pem";
    config.service.teacher_password_file = "/school/password";
    auto const files = session_server_files(config, "/opt/conf/session.json", "/run/w/session-1999.sock");
    for (auto const* folder : {"/opt/conf", "/certs/live", "/keys", "/srv", "/secrets", "/var/www/acme",
                               "/authorities", "/school", "/etc"})
        BOOST_TEST(has(files.read, folder), folder);
    BOOST_TEST(has(files.write, "/var/log/webots"));
    BOOST_TEST(has(files.write, "/run/w"));
    BOOST_TEST(files.write.size() == 3U);
    for (auto const* folder : {"/", "/home", "/root", "/var", "/tmp", "/dev", ""})
        BOOST_TEST((!has(files.read, folder) && !has(files.write, folder)), folder);
}

BOOST_AUTO_TEST_CASE(what_is_not_configured_needs_nothing)
{
    SessionConfig config;
    config.log_dir = "/log";
    auto const with_token = [&] {
        auto other = config;
        other.access.operator_token_file = "/t/token";
        return session_server_files(other, "/c/c.json", "/s/s.sock");
    }();
    auto const files = session_server_files(config, "/c/c.json", "/s/s.sock");
    BOOST_TEST(files.read.size() + 1 == with_token.read.size());
}

BOOST_AUTO_TEST_SUITE_END()
