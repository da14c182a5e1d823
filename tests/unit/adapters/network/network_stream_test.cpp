#include "unit_test.hpp"

#include "adapters/network/network_stream.hpp"

#include <boost/asio/io_context.hpp>

using namespace webots_cloud;
using boost::asio::ip::tcp;

BOOST_AUTO_TEST_SUITE(network_stream)

// Protocol section 4.1: heartbeats and progress are small and must not wait for each other.
BOOST_AUTO_TEST_CASE(small_messages_leave_at_once)
{
    boost::asio::io_context context;
    tcp::acceptor acceptor(context, tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0));
    tcp::socket browser(context);
    browser.connect(acceptor.local_endpoint());
    adapters::NetworkStream stream(acceptor.accept(), nullptr);
    tcp::no_delay option;
    stream.socket().get_option(option);
    BOOST_TEST(option.value());
}

BOOST_AUTO_TEST_SUITE_END()
