#include "unit_test.hpp"

#include "adapters/names/name_channel.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/process.hpp>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

using namespace webots_cloud;
using namespace std::chrono_literals;
using adapters::NameChannel;
using adapters::NamedAddresses;
namespace asio = boost::asio;
namespace process = boost::process;

BOOST_AUTO_TEST_SUITE(name_channel)

namespace {

constexpr auto dnsmasq = "/usr/sbin/dnsmasq";

boost::test_tools::assertion_result has_dnsmasq(boost::unit_test::test_unit_id)
{
    boost::test_tools::assertion_result there = std::filesystem::exists(dnsmasq);
    there.message() << "skipped: there is no dnsmasq";
    return there;
}

std::uint16_t free_port()
{
    asio::io_context context;
    asio::ip::tcp::acceptor const bound(context, {asio::ip::address_v4::loopback(), 0});
    return bound.local_endpoint().port();
}

/// A real name server of `site.test`.
class NameServer
{
public:
    explicit NameServer(std::vector<std::string> const& records) : port_(free_port())
    {
        std::vector<std::string> words{"--no-daemon",   "--port=" + std::to_string(port_),
                                       "--no-hosts",    "--listen-address=127.0.0.1",
                                       "--no-resolv",   "--bind-interfaces",
                                       "--conf-file",   "--pid-file",
                                       "--user=root",   "--group=root",
                                       "--local=/test/"};
        if (::geteuid() != 0)
            words.erase(words.end() - 3, words.end() - 1);
        words.insert(words.end(), records.begin(), records.end());
        server_ = process::child(dnsmasq, process::args(words), process::std_err > log_,
                                 process::std_out > process::null, process::std_in < process::null);
        std::string line;
        while (std::getline(log_, line) && line.find("started") == std::string::npos) {
        }
    }
    ~NameServer()
    {
        server_.terminate();
        server_.wait();
    }
    NameServer(NameServer const&) = delete;
    NameServer& operator=(NameServer const&) = delete;

    std::string address() const { return "127.0.0.1:" + std::to_string(port_); }

private:
    std::uint16_t port_;
    process::ipstream log_;
    process::child server_;
};

struct Asking
{
    explicit Asking(std::string servers = "") : channel(std::in_place, context.get_executor(), servers) {}

    /// Asks and waits.
    result<NamedAddresses> addresses(std::string const& name)
    {
        std::optional<result<NamedAddresses>> found;
        channel->ask_addresses(name, false,
                               [&](result<NamedAddresses> answer) { found = std::move(answer); });
        return wait_for(found);
    }
    result<NameAnswer> services(std::string const& name)
    {
        std::optional<result<NameAnswer>> found;
        channel->ask_services(name, [&](result<NameAnswer> answer) { found = std::move(answer); });
        return wait_for(found);
    }

    asio::io_context context{1};
    std::optional<NameChannel> channel;

private:
    template<class Answer>
    Answer wait_for(std::optional<Answer> const& found)
    {
        auto const end = std::chrono::steady_clock::now() + 60s; // a deadline for a broken channel only
        context.restart();
        while (!found && std::chrono::steady_clock::now() < end)
            context.run_one_for(1s);
        BOOST_TEST_REQUIRE(found.has_value());
        return *found;
    }
};

std::vector<std::string> texts(NamedAddresses const& named)
{
    std::vector<std::string> found;
    for (auto const& address : named.addresses)
        found.push_back(address.to_string());
    std::sort(found.begin(), found.end());
    return found;
}

} // namespace

BOOST_AUTO_TEST_CASE(localhost_and_numeric_addresses_need_no_server)
{
    Asking asking("127.0.0.1:1");
    auto const local = asking.addresses("localhost");
    BOOST_TEST_REQUIRE(local.has_value());
    std::vector<std::string> const both{"127.0.0.1", "::1"}; // whatever /etc/hosts says
    BOOST_TEST(texts(*local) == both, boost::test_tools::per_element());
    auto const below = asking.addresses("site.localhost");
    BOOST_TEST_REQUIRE(below.has_value());
    BOOST_TEST(texts(*below) == both, boost::test_tools::per_element());
    auto const numeric = asking.addresses("192.0.2.7");
    BOOST_TEST_REQUIRE(numeric.has_value());
    BOOST_TEST(texts(*numeric) == std::vector<std::string>{"192.0.2.7"}, boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_name_that_is_too_long_is_refused_without_asking)
{
    auto const unknown = Asking("127.0.0.1:1").addresses(std::string(300, 'x'));
    BOOST_TEST_REQUIRE(!unknown.has_value());
    BOOST_TEST(unknown.error().message().starts_with("the name xxx"));
}

BOOST_AUTO_TEST_CASE(what_is_no_address_of_a_server_is_named)
{
    auto const nothing = Asking("rubbish").addresses("site.test");
    BOOST_TEST_REQUIRE(!nothing.has_value());
    BOOST_TEST(nothing.error().message() ==
               "the name site.test can't be resolved: expected numeric addresses "
               "of name servers, found rubbish");
}

BOOST_AUTO_TEST_CASE(a_server_that_is_not_there_is_no_answer)
{
    auto const nothing = Asking("127.0.0.1:1").services("_webots._tcp.site.test");
    BOOST_TEST_REQUIRE(!nothing.has_value());
    BOOST_TEST((nothing.error() == errc::unreachable));
}

BOOST_AUTO_TEST_CASE(addresses_come_with_their_ttl, *boost::unit_test::precondition(has_dnsmasq))
{
    NameServer const server(
        {"--host-record=site.test,192.0.2.1,2001:db8::1,77", "--host-record=site.test,192.0.2.2,77"});
    Asking asking(server.address());
    auto const found = asking.addresses("site.test");
    BOOST_TEST_REQUIRE(found.has_value());
    std::vector<std::string> const wanted{"192.0.2.1", "192.0.2.2", "2001:db8::1"};
    BOOST_TEST(texts(*found) == wanted, boost::test_tools::per_element());
    BOOST_TEST((found->ttl == 77s));
    auto const unknown = asking.addresses("nobody.test");
    BOOST_TEST((unknown.error() == errc::not_found));
}

BOOST_AUTO_TEST_CASE(services_come_with_priority_weight_port_and_ttl,
                     *boost::unit_test::precondition(has_dnsmasq))
{
    NameServer const server({"--srv-host=_webots._tcp.site.test,one.site.test,2000,10,60",
                             "--srv-host=_webots._tcp.site.test,two.site.test,2001,20,0", "--local-ttl=33"});
    Asking asking(server.address());
    auto const found = asking.services("_webots._tcp.site.test");
    BOOST_TEST_REQUIRE(found.has_value());
    BOOST_TEST_REQUIRE(found->services.size() == 2);
    auto services = found->services;
    std::sort(services.begin(), services.end(),
              [](auto const& one, auto const& other) { return one.target < other.target; });
    BOOST_TEST(services[0].target == "one.site.test");
    BOOST_TEST(services[0].port == 2000);
    BOOST_TEST(services[0].priority == 10);
    BOOST_TEST(services[0].weight == 60);
    BOOST_TEST(services[1].target == "two.site.test");
    BOOST_TEST(services[1].priority == 20);
    BOOST_TEST((found->ttl == 33s));
    auto const unknown = asking.services("_none._tcp.site.test");
    BOOST_TEST((unknown.error() == errc::not_found));
}

BOOST_AUTO_TEST_CASE(an_answer_that_is_too_large_for_udp_comes_by_tcp,
                     *boost::unit_test::precondition(has_dnsmasq))
{
    std::vector<std::string> records;
    for (int i = 0; i < 500; ++i)
        records.push_back("--host-record=crowd.test,10.1." + std::to_string(i / 250) + "." +
                          std::to_string(i % 250 + 1));
    NameServer const server(records);
    auto const found = Asking(server.address()).addresses("crowd.test");
    BOOST_TEST_REQUIRE(found.has_value());
    BOOST_TEST(found->addresses.size() == 500);
}

BOOST_AUTO_TEST_CASE(a_server_that_hangs_delays_no_answer_of_another_and_nothing_comes_after_the_end,
                     *boost::unit_test::precondition(has_dnsmasq))
{
    asio::io_context context;
    asio::ip::udp::socket const silent(context, {asio::ip::address_v4::loopback(), 0});
    Asking asking("127.0.0.1:" + std::to_string(silent.local_endpoint().port()));
    bool is_answered = false;
    for (int i = 0; i < 100; ++i)
        asking.channel->ask_addresses("site" + std::to_string(i) + ".test", false,
                                      [&](result<NamedAddresses> const&) { is_answered = true; });
    BOOST_TEST(asking.addresses("localhost").has_value());
    BOOST_TEST(!is_answered);
    asking.channel.reset();
    asking.context.restart();
    asking.context.run(); // there is nothing left to wait for
    BOOST_TEST(!is_answered);
}

BOOST_AUTO_TEST_CASE(garbage_is_no_answer)
{
    Asking asking("127.0.0.1:1");
    asio::ip::udp::socket liar(asking.context, {asio::ip::address_v4::loopback(), 0});
    asking.channel.emplace(asking.context.get_executor(),
                           "127.0.0.1:" + std::to_string(liar.local_endpoint().port()));
    std::vector<char> question(512);
    asio::ip::udp::endpoint asker;
    int questions = 0;
    std::function<void()> const lie = [&] {
        liar.async_receive_from(asio::buffer(question), asker, [&](auto failed, std::size_t size) {
            if (failed)
                return;
            ++questions;
            // the answer to this question: "one SRV record", which ends in the middle
            question[2] = static_cast<char>(0x81);
            question[3] = static_cast<char>(0x80);
            question[7] = 1;
            liar.send_to(asio::buffer(question, size), asker);
            lie();
        });
    };
    lie();
    auto const found = asking.services("_webots._tcp.site.test");
    BOOST_TEST(!found.has_value());
    BOOST_TEST(questions > 0);
}

BOOST_AUTO_TEST_SUITE_END()
