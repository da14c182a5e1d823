#include "unit_test.hpp"

#include "core/simulation/simulator_environment.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <optional>

using namespace webots_cloud::core;

// Protocol section 6.1: the Python server passes on all of its environment.
BOOST_AUTO_TEST_SUITE(the_simulators_environment)

namespace {

using Entries = std::vector<std::string>;

std::optional<std::string> value_in(Environment const& environment, std::string_view name)
{
    auto const is_it = [name](auto const& variable) { return variable.first == name; };
    BOOST_TEST(std::count_if(environment.begin(), environment.end(), is_it) <= 1, name << " is there twice");
    auto const found = std::find_if(environment.begin(), environment.end(), is_it);
    return found == environment.end() ? std::nullopt : std::optional(found->second);
}

/// What the simulator gets for a variable that is `value` in the server's environment.
std::optional<std::string> passed(std::string const& name, std::string const& value,
                                  Entries const& entries = {})
{
    return value_in(simulator_environment({{name, value}}, entries, ":0"), name);
}

} // namespace

BOOST_AUTO_TEST_CASE(what_webots_drivers_languages_and_networks_need_is_passed_on)
{
    for (auto const name :
         split("HOME LC_ALL TZ XDG_RUNTIME_DIR WEBOTS_HOME PYTHONPATH PYTHONUNBUFFERED LD_LIBRARY_PATH "
               "LD_PRELOAD CLASSPATH MATLAB_HOME MATLABPATH MLM_LICENSE_FILE CONDA_PREFIX ROS_DOMAIN_ID "
               "ROS_SECURITY_KEYSTORE RMW_IMPLEMENTATION AMENT_PREFIX_PATH COLCON_PREFIX_PATH CYCLONEDDS_URI "
               "FASTRTPS_DEFAULT_PROFILES_FILE http_proxy HTTPS_PROXY all_proxy NO_PROXY SSL_CERT_FILE "
               "REQUESTS_CA_BUNDLE CURL_CA_BUNDLE __GLX_VENDOR_LIBRARY_NAME __NV_PRIME_RENDER_OFFLOAD "
               "__EGL_VENDOR_LIBRARY_FILENAMES VGL_DISPLAY LIBGL_ALWAYS_SOFTWARE MESA_GL_VERSION_OVERRIDE "
               "GALLIUM_DRIVER CUDA_VISIBLE_DEVICES NVIDIA_VISIBLE_DEVICES VK_ICD_FILENAMES PULSE_SERVER "
               "QT_QPA_PLATFORM XAUTHORITY",
               ' '))
        BOOST_TEST((passed(std::string(name), "v") == "v"), name);
    BOOST_TEST((passed("DISPLAY", ":9") == ":0")); // the server has chosen the screen already
}

BOOST_AUTO_TEST_CASE(without_a_screen_of_the_machine_nothing_leads_to_one)
{
    Environment const ours{
        {"DISPLAY", ":0"}, {"WAYLAND_DISPLAY", "wayland-0"}, {"XAUTHORITY", "/x"}, {"LANG", "C"}};
    BOOST_TEST((simulator_environment(ours, {}, "") == Environment{{"LANG", "C"}}));
    BOOST_TEST((simulator_environment(ours, {"DISPLAY"}, "") == Environment{{"LANG", "C"}}));
}

BOOST_AUTO_TEST_CASE(secrets_and_what_systemd_says_to_the_server_are_not)
{
    for (auto const name :
         split("AWS_SECRET_ACCESS_KEY GITHUB_TOKEN WEBOTS_PASSWORD ROS_API_KEY XDG_SESSION_TOKEN CONDA_TOKEN "
               "QT_PRIVATE_KEY NVIDIA_APIKEY WEBOTS_mailPassword CUDA_AUTH NOTIFY_SOCKET "
               "CREDENTIALS_DIRECTORY LISTEN_FDS INVOCATION_ID JOURNAL_STREAM STATE_DIRECTORY SSH_AUTH_SOCK "
               "DBUS_SESSION_BUS_ADDRESS DATABASE_URL Http_Proxy PWD",
               ' '))
        BOOST_TEST((passed(std::string(name), "v") == std::nullopt), name);
}

BOOST_AUTO_TEST_CASE(an_address_with_a_password_is_a_secret_whatever_its_name)
{
    for (auto const* secret : {"http://user:pw@proxy:3128", "user:pw@proxy:3128",
                               "http://user:p/w@proxy:3128", "http://:pw@proxy/"})
        BOOST_TEST((passed("http_proxy", secret) == std::nullopt), secret);
    for (auto const* open :
         {"http://proxy:3128", "proxy:3128", "http://user@proxy:3128", "http://[::1]:3128/"})
        BOOST_TEST((passed("HTTPS_PROXY", open) == open), open);
    BOOST_TEST((passed("ROS_MASTER_URI", "a,http://u:p@h/") == std::nullopt));
    BOOST_TEST((passed("CYCLONEDDS_URI", "<x a='https://h:1/s'><b>c:d@e</b></x>") != std::nullopt));
}

BOOST_AUTO_TEST_CASE(entries_name_a_variable_its_beginning_or_a_value)
{
    BOOST_TEST((passed("LAB_SERVER", "v") == std::nullopt));
    BOOST_TEST((passed("LAB_SERVER", "v", {"LAB_SERVER"}) == "v"));
    BOOST_TEST((passed("LAB_SERVER", "v", {"LAB_*"}) == "v"));
    BOOST_TEST((passed("LAB_SERVER", "v", {"LAB_"}) == std::nullopt));
    BOOST_TEST((passed("LAB_SERVER", "v", {"*"}) == "v"));
    BOOST_TEST((passed("LAB_SERVER", "v", {"LAB_SERVER=a=b c"}) == "a=b c"));
    BOOST_TEST((passed("ROS_DOMAIN_ID", "1", {"ROS_DOMAIN_ID=2"}) == "2"));
    BOOST_TEST((passed("PYTHONPATH", "/x", {"PYTHONPATH="}) == ""));
    BOOST_TEST((passed("A", "1", {"A=2", "A=3"}) == "3"));
    BOOST_TEST((passed("A", "1", {"A=2", "A"}) == "1"));
    BOOST_TEST((passed("A", "1", {"A=*", "*"}) == "*")); // a pattern can't set a value
    BOOST_TEST((passed("A", "1", {"B"}) == std::nullopt));
}

BOOST_AUTO_TEST_CASE(secrets_have_to_be_named_and_patterns_find_none)
{
    BOOST_TEST((passed("LAB_TOKEN", "v", {"LAB_*", "*"}) == std::nullopt));
    BOOST_TEST((passed("LAB_TOKEN", "v", {"LAB_TOKEN"}) == "v"));
    BOOST_TEST((passed("DATABASE", "pg://u:p@h/db", {"*"}) == std::nullopt));
    BOOST_TEST((passed("https_proxy", "http://u:p@h", {"*"}) == std::nullopt));
    BOOST_TEST((passed("https_proxy", "http://u:p@h", {"https_proxy"}) == "http://u:p@h"));
    BOOST_TEST((passed("NOTIFY_SOCKET", "/run/x", {"NOTIFY_*", "*"}) == std::nullopt));
    BOOST_TEST((passed("BASH_FUNC_x%%", "() { :; }", {"*"}) == std::nullopt));
}

BOOST_AUTO_TEST_CASE(unusable_entries_are_told_what_was_expected)
{
    for (auto const* entry : {"A", "_a1", "ROS_*", "*", "A=", "A=b=c", "A=*", "DISPLAY"})
        BOOST_TEST(wanted_instead(entry) == "", entry);
    for (auto const* entry : {"", "=", "=v", "1A", "A B", "A-B=1", "**", "*A", "A*B", "1*", "A*=1"})
        BOOST_TEST(wanted_instead(entry) ==
                       "the name of a variable, the beginning of one as in \"ROS_*\", or \"NAME=value\"",
                   entry);
    BOOST_TEST(wanted_instead("NOTIFY_SOCKET") == "no variable that systemd gives to this server alone");
    BOOST_TEST(wanted_instead("LISTEN_FDS=3") == "no variable that systemd gives to this server alone");
    BOOST_TEST(wanted_instead("DISPLAY=:1") == "no value for DISPLAY: the key \"display\" sets it");
    BOOST_TEST(wanted_instead("A=" + std::string(40'000, 'x')) == "at most 32768 characters");
    BOOST_TEST(wanted_instead(std::string(300, 'A')) != "");
}

BOOST_AUTO_TEST_CASE(the_operator_is_told_the_names_of_what_is_left_out_and_no_values)
{
    Environment const ours{{"HOME", "/h"},
                           {"LAB", "secret1"},
                           {"API_TOKEN", "secret2"},
                           {"SHLVL", "1"},
                           {"PWD", "/x"},
                           {"NOTIFY_SOCKET", "/run/n"},
                           {"DISPLAY", ":1"},
                           {"http_proxy", "http://u:secret3@h"}};
    auto const remarks = environment_remarks(ours, {"ROS_DOMAIN_ID", "A=1", "B_*"});
    BOOST_TEST(
        remarks.notices ==
            Entries{"Simulators do not get these variables of the server's environment: API_TOKEN, LAB. "
                    "To pass one on, name it in \"simulatorEnvironment\"."},
        boost::test_tools::per_element());
    BOOST_TEST(remarks.warnings == (Entries{"Simulators do not get http_proxy: there is a password in it, "
                                            "which their programs could read. "
                                            "If they may, name it in \"simulatorEnvironment\".",
                                            "\"simulatorEnvironment\" names ROS_DOMAIN_ID, which the "
                                            "server's own environment does not have."}),
               boost::test_tools::per_element());
    auto const nothing = environment_remarks(ours, {"LAB", "API_TOKEN", "http_proxy"});
    BOOST_TEST(nothing.notices.empty());
    BOOST_TEST(nothing.warnings.empty());
}

BOOST_AUTO_TEST_CASE(the_list_of_names_is_short_and_harmless_however_long_and_strange_they_are)
{
    Environment ours;
    for (int i = 0; i < 3000; ++i)
        ours.emplace_back("N\x1b" + std::to_string(1000 + i) + std::string(5000, 'x'), "");
    auto const remarks = environment_remarks(ours, {});
    BOOST_TEST_REQUIRE(remarks.notices.size() == 1u);
    BOOST_TEST(remarks.notices[0].size() < 2000u);
    BOOST_TEST(remarks.notices[0].find('\x1b') == std::string::npos);
    BOOST_TEST(remarks.notices[0].find(" and 2980 more.") != std::string::npos);
}

BOOST_AUTO_TEST_SUITE_END()
