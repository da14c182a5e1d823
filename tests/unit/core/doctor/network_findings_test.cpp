#include "unit_test.hpp"

#include "core/doctor/network_findings.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(network_findings)

namespace {

constexpr auto day = std::chrono::hours(24);
WallTime const now = WallTime() + 20'000 * day; // 2024-10-04

CertificateFacts good_certificate()
{
    CertificateFacts facts;
    facts.names = "robots.example.org";
    facts.issuer = "R11";
    facts.begins = now - 30 * day;
    facts.ends = now + 60 * day;
    return facts;
}

Finding judge(CertificateFacts const& facts)
{
    return judge_certificate({}, facts, "robots.example.org", now);
}

} // namespace

BOOST_AUTO_TEST_CASE(a_port_is_free_ours_or_taken)
{
    BOOST_TEST((judge_port("\"port\"", 2000, PortHolder::nobody, {}) ==
                Finding(Verdict::ok, "port 2000", "it is free, the server does not run")));
    BOOST_TEST((judge_port("\"port\"", 2000, PortHolder::this_server, {}).verdict == Verdict::ok));
    auto const taken = judge_port("\"port\"", 2000, PortHolder::other, {});
    BOOST_TEST((taken.verdict == Verdict::fault));
    BOOST_TEST(taken.remedy == "End it (ss -tlnp says what it is), or change \"port\".");
    auto const forbidden = judge_port("\"redirectPort\"", 80, PortHolder::forbidden, {});
    BOOST_TEST((forbidden.verdict == Verdict::fault));
    BOOST_TEST(forbidden.found == "this user may not open port 80");
    BOOST_TEST(forbidden.remedy.ends_with("with \"redirectPort\"."));
    auto const elsewhere = judge_port("\"port\"", 2000, PortHolder::elsewhere, "203.0.113.7");
    BOOST_TEST((elsewhere.verdict == Verdict::fault));
    BOOST_TEST(elsewhere.found.starts_with("203.0.113.7 is none of this machine's addresses"));
    auto const unusable = judge_port("\"port\"", 2000, PortHolder::unusable, "Protocol not supported");
    BOOST_TEST((unusable.verdict == Verdict::fault));
    BOOST_TEST(unusable.found == "nobody can listen there: Protocol not supported");
}

BOOST_AUTO_TEST_CASE(simulators_need_ports_too)
{
    BOOST_TEST((judge_simulation_ports(2001, 100, 100) ==
                Finding(Verdict::ok, "ports from 2001", "100 of the 100 ports for simulators are free")));
    BOOST_TEST((judge_simulation_ports(2001, 100, 99).verdict == Verdict::warning));
    BOOST_TEST((judge_simulation_ports(2001, 100, 0).verdict == Verdict::fault));
}

BOOST_AUTO_TEST_CASE(a_good_certificate_says_how_long_it_lasts)
{
    BOOST_TEST((judge(good_certificate()) ==
                Finding(Verdict::ok, "certificate", "for robots.example.org, valid for 60 days")));
}

BOOST_AUTO_TEST_CASE(a_certificate_that_ends_soon_is_a_warning_and_one_that_has_ended_a_fault)
{
    auto facts = good_certificate();
    facts.ends = now + 13 * day;
    BOOST_TEST((judge(facts).verdict == Verdict::warning));
    BOOST_TEST(judge(facts).found == "for robots.example.org, valid for 13 days");
    facts.ends = now;
    BOOST_TEST((judge(facts).verdict == Verdict::fault));
    BOOST_TEST(judge(facts).found == "it has expired on 2024-10-04 00:00:00 UTC");
    facts = good_certificate();
    facts.begins = now + day;
    BOOST_TEST((judge(facts).verdict == Verdict::fault));
    BOOST_TEST(judge(facts).found == "it is not valid before 2024-10-05 00:00:00 UTC");
}

BOOST_AUTO_TEST_CASE(a_certificate_has_to_be_for_the_server_and_from_somebody_known)
{
    auto facts = good_certificate();
    facts.chain_problem = "self-signed certificate";
    BOOST_TEST((judge(facts).verdict == Verdict::warning));
    BOOST_TEST(judge(facts).found == "browsers will not believe it: self-signed certificate (signed by R11)");
    facts.fits = false;
    BOOST_TEST((judge(facts).verdict == Verdict::fault));
    facts.names = "other.example.org";
    BOOST_TEST(judge(facts).found == "it is for other.example.org, and not for robots.example.org");
}

BOOST_AUTO_TEST_CASE(a_short_key_is_told_whether_openssl_takes_it_or_not)
{
    auto facts = good_certificate();
    facts.key_bits = 1024;
    facts.is_weak = true;
    Finding const wanted(Verdict::fault, "certificate", "its key has only 1024 bits, and browsers refuse it",
                         "Get one with a key of 2048 bits, or of an elliptic curve.");
    BOOST_TEST((judge(facts) == wanted));
    result<> const pair = Failure(errc::invalid_config, "ee key too small");
    BOOST_TEST((judge_certificate(pair, facts, "robots.example.org", now) == wanted));
}

BOOST_AUTO_TEST_CASE(of_a_machine_behind_a_proxy_the_port_is_told)
{
    auto const found =
        judge_simulation_server("localhost/2000", Failure(errc::unreachable, "Connection refused"), 80);
    BOOST_TEST((found.verdict == Verdict::fault));
    BOOST_TEST(found.found ==
               "asked at port 80 of localhost, where a proxy has to lead to it: Connection refused");
    BOOST_TEST((judge_simulation_server("localhost/2000", LoadReport(1), 80).verdict == Verdict::ok));
}

BOOST_AUTO_TEST_CASE(files_that_can_not_be_used_as_a_certificate_are_a_fault)
{
    result<> const pair = Failure(errc::invalid_config, "the key k.pem can't be used");
    auto const finding = judge_certificate(pair, good_certificate(), "robots.example.org", now);
    BOOST_TEST((finding == Finding(Verdict::fault, "certificate", "the key k.pem can't be used",
                                   "Correct \"sslCertificate\" and \"sslKey\".")));
}

BOOST_AUTO_TEST_CASE(a_forge_has_to_answer_whatever_it_says)
{
    BOOST_TEST((judge_forge("https://a.org", 200) == Finding(Verdict::ok, "forge", "https://a.org answers")));
    BOOST_TEST((judge_forge("https://a.org", 404).verdict == Verdict::ok));
    BOOST_TEST((judge_forge("https://a.org", 503).verdict == Verdict::warning));
    auto const lost = judge_forge("https://a.org", Failure(errc::unreachable, "no such name"));
    BOOST_TEST((lost.verdict == Verdict::fault));
    BOOST_TEST(lost.found == "https://a.org is not reached: no such name");
}

BOOST_AUTO_TEST_CASE(simulations_run_without_a_registry)
{
    auto const lost = judge_registry("https://a.org/r", Failure(errc::timed_out, "too late"));
    BOOST_TEST((lost.verdict == Verdict::warning));
    BOOST_TEST(lost.found == "https://a.org/r is not reached: too late");
}

BOOST_AUTO_TEST_CASE(a_simulation_server_says_its_load_or_is_a_fault)
{
    LoadReport report(12.7);
    BOOST_TEST((judge_simulation_server("a:2000", report) ==
                Finding(Verdict::ok, "machine a:2000", "it answers, its load is 12%")));
    report.draining = true;
    BOOST_TEST((judge_simulation_server("a:2000", report).verdict == Verdict::warning));
    auto const lost = judge_simulation_server("a:2000", Failure(errc::unreachable, "refused"));
    BOOST_TEST((lost.verdict == Verdict::fault));
    BOOST_TEST(lost.found == "refused");
}

BOOST_AUTO_TEST_CASE(a_name_has_to_stand_for_machines)
{
    BOOST_TEST((judge_machine_name("dns:sim:2000", 2, "") ==
                Finding(Verdict::ok, "machine dns:sim:2000", "it stands for 2 machines")));
    BOOST_TEST((judge_machine_name("dns:sim:2000", 1, "a lie").verdict == Verdict::warning));
    auto const lost = judge_machine_name("dns:sim:2000", 0, "no answer");
    BOOST_TEST((lost.verdict == Verdict::fault));
    BOOST_TEST(lost.found == "no answer");
}

BOOST_AUTO_TEST_CASE(a_mail_server_has_to_take_mails)
{
    BOOST_TEST((judge_mail_server("m:25", {}) == Finding(Verdict::ok, "mail", "m:25 takes mails from us")));
    result<> const refused = Failure(errc::refused, "m offers no login");
    BOOST_TEST((judge_mail_server("m:25", refused).verdict == Verdict::fault));
    BOOST_TEST(judge_mail_server("m:25", refused).found == "m:25: m offers no login");
}

BOOST_AUTO_TEST_CASE(the_public_address_has_to_lead_to_this_very_server)
{
    PublicReading reading;
    reading.status = 200;
    reading.instance = reading.own_instance = "abc";
    auto const verdict = [&] { return judge_public_address(reading, "https://r.org/livez"); };
    BOOST_TEST((verdict() == Finding(Verdict::ok, "public address", "https://r.org/livez leads here")));
    reading.instance = "xyz";
    BOOST_TEST(verdict().found == "https://r.org/livez leads to another server than this one");
    BOOST_TEST((verdict().verdict == Verdict::fault));
    reading.instance.clear();
    reading.status = 404;
    BOOST_TEST(verdict().found ==
               "https://r.org/livez does not lead to this server: HTTP status 404 from another program");
    BOOST_TEST((verdict().verdict == Verdict::fault));
    auto const lost = judge_public_address(Failure(errc::unreachable, "refused"), "https://r.org/livez");
    BOOST_TEST(lost.found == "https://r.org/livez is not reached: refused");
}

BOOST_AUTO_TEST_CASE(a_name_has_to_be_found)
{
    BOOST_TEST(
        (judge_name("r.org", std::size_t{1}) == Finding(Verdict::ok, "name server", "r.org has 1 address")));
    BOOST_TEST(judge_name("r.org", std::size_t{2}).found == "r.org has 2 addresses");
    auto const lost = judge_name("r.org", Failure(errc::not_found, "the name r.org can't be resolved"));
    BOOST_TEST((lost.verdict == Verdict::fault));
    BOOST_TEST(lost.found == "the name r.org can't be resolved");
}

BOOST_AUTO_TEST_CASE(a_firewall_that_drops_everything_has_to_name_the_port)
{
    auto const nft = "table inet filter {\n\tchain input {\n"
                     "\t\ttype filter hook input priority filter; policy drop;\n"
                     "\t\ttcp dport { 22, 80, 1990-2010 } accept\n\t}\n}\n";
    BOOST_TEST(parse_firewall(nft, 2000).drops_by_default);
    BOOST_TEST(parse_firewall(nft, 2000).names_port);
    BOOST_TEST(parse_firewall(nft, 80).names_port);
    BOOST_TEST(!parse_firewall(nft, 2011).names_port);
    BOOST_TEST((judge_firewall(parse_firewall(nft, 2000), 2000).verdict == Verdict::ok));
    auto const closed = judge_firewall(parse_firewall(nft, 2011), 2011);
    BOOST_TEST((closed.verdict == Verdict::warning));
    BOOST_TEST(closed.found == "it drops what comes in unless a rule accepts it, and none names port 2011");
}

BOOST_AUTO_TEST_CASE(rules_of_iptables_are_understood_too)
{
    auto const rules = "-P INPUT DROP\n-A INPUT -p tcp -m multiport --dports 22,1999:2001 -j ACCEPT\n";
    BOOST_TEST(parse_firewall(rules, 2000).drops_by_default);
    BOOST_TEST(parse_firewall(rules, 2000).names_port);
    BOOST_TEST(!parse_firewall(rules, 2002).names_port);
    BOOST_TEST(!parse_firewall("-P INPUT ACCEPT\n", 2000).drops_by_default);
    BOOST_TEST(!parse_firewall("--dport 99999999999999999999 x", 9).names_port);
}

BOOST_AUTO_TEST_CASE(a_firewall_that_can_not_be_seen_is_no_fault)
{
    auto const finding = judge_firewall(FirewallReading(), 2000);
    BOOST_TEST((finding.verdict == Verdict::ok));
    BOOST_TEST(finding.found.starts_with("what is filtered can't be seen"));
}

BOOST_AUTO_TEST_SUITE_END()
