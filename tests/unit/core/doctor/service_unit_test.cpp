#include "unit_test.hpp"

#include "core/doctor/service_unit.hpp"

using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(service_unit)

BOOST_AUTO_TEST_CASE(what_the_program_finds_around_it_is_kept_in_its_order)
{
    auto const unit = parse_service_unit("# /lib/systemd/system/x.service\n"
                                         "[Unit]\n"
                                         "Description=X\n"
                                         "[Service]\n"
                                         "User = web\n"
                                         "SystemCallFilter=@system-service\n"
                                         "; a remark\n"
                                         "SystemCallFilter=~@privileged\n"
                                         "CapabilityBoundingSet=\n"
                                         "[Install]\n"
                                         "WantedBy=multi-user.target\n",
                                         "x");
    BOOST_TEST(unit.settings ==
                   (std::vector<std::string>{"User=web", "SystemCallFilter=@system-service",
                                             "SystemCallFilter=~@privileged", "CapabilityBoundingSet="}),
               boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(how_it_is_started_watched_and_ended_is_left_out)
{
    auto const unit = parse_service_unit("[Service]\n"
                                         "Type=notify\n"
                                         "ExecStart=/usr/bin/x /etc/x.json\n"
                                         "ExecReload=/bin/kill\n"
                                         "Restart=on-failure\n"
                                         "RestartSec=2\n"
                                         "RestrictRealtime=yes\n"
                                         "WatchdogSec=30\n"
                                         "TimeoutStopSec=15\n"
                                         "RuntimeDirectory=x\n"
                                         "KillMode=mixed\n",
                                         "x");
    BOOST_TEST(unit.settings == std::vector<std::string>{"RestrictRealtime=yes"},
               boost::test_tools::per_element());
    BOOST_TEST(unit.command == "/usr/bin/x /etc/x.json");
}

BOOST_AUTO_TEST_CASE(a_unit_that_has_users_made_for_simulations_is_known)
{
    auto const pins = [](char const* text) { return parse_service_unit(text, "x").pins_users; };
    BOOST_TEST(!pins("[Service]\nExecStartPre=/bin/true\n"));
    BOOST_TEST(!pins("[Service]\nExecStopPost=+/usr/bin/guard --unpin-users /run/x\n"));
    BOOST_TEST(pins("[Service]\nExecStartPre=-+/usr/bin/guard --pin-users %t/x\nExecStartPre=/bin/true\n"));
    BOOST_TEST(!pins("[Service]\nExecStartPre=+/usr/bin/guard --pin-users %t/x\n[Service]\nExecStartPre=\n"));
}

BOOST_AUTO_TEST_CASE(drop_in_files_come_after_the_unit)
{
    auto const unit = parse_service_unit("[Service]\nExecStart=/usr/bin/x /etc/x.json\n"
                                         "# /etc/systemd/system/x.service.d/override.conf\n"
                                         "[Service]\nExecStart=\nExecStart=/usr/bin/x \\\n  /srv/x.json\n",
                                         "x");
    BOOST_TEST(unit.command == "/usr/bin/x /srv/x.json");
}

BOOST_AUTO_TEST_CASE(a_user_whom_systemd_makes_is_the_one_of_the_service)
{
    auto const settings = [](char const* text) { return parse_service_unit(text, "x").settings; };
    BOOST_TEST(settings("[Service]\nDynamicUser=yes\n").back() == "User=x");
    BOOST_TEST(settings("[Service]\nDynamicUser=yes\nUser=web\n").back() == "User=web");
    BOOST_TEST(settings("[Service]\nDynamicUser=no\n").back() == "DynamicUser=no");
}

BOOST_AUTO_TEST_SUITE_END()
