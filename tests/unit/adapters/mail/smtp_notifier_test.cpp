// Mail servers that say nothing, and being ended in the middle; what real ones say is in
// tests/integration/mail_test.py.
#include "adapters/mail/loaded_curl.hpp"
#include "unit_test.hpp"

#include <webots_cloud/adapters.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/write.hpp>

#include <array>
#include <cstring>
#include <memory>
#include <optional>

using namespace webots_cloud;
using namespace std::chrono_literals;
namespace asio = boost::asio;
using asio::ip::tcp;

BOOST_AUTO_TEST_SUITE(smtp_notifier)

namespace {

asio::awaitable<result<>> deliver(Notifier& notifier, std::string text = "Text\n")
{
    Notice notice("Subject", std::move(text));
    co_return co_await notifier.deliver(std::move(notice));
}

/// Delivers after having been cancelled.
asio::awaitable<result<>> deliver_late(Notifier& notifier)
{
    co_await asio::this_coro::throw_if_cancelled(false);
    auto const executor = co_await asio::this_coro::executor;
    asio::steady_timer never(executor, std::chrono::steady_clock::time_point::max());
    (void)co_await never.async_wait(asio::as_tuple(asio::use_awaitable));
    co_return co_await deliver(notifier);
}

/// A listening port whose connections only the kernel accepts, and a notifier that mails to it.
struct Fixture
{
    explicit Fixture(Duration timeout = 1min)
    {
        MailConfig mail;
        mail.server = "127.0.0.1";
        mail.server_port = acceptor.local_endpoint().port();
        mail.sender = "from@a.org";
        mail.administrator = "to@b.org";
        mail.timeout = timeout;
        notifier = make_smtp_notifier(std::move(mail)).value();
    }

    void begin(std::string text = "Text\n")
    {
        auto finished = [this](std::exception_ptr, result<> ended) { outcome = std::move(ended); };
        asio::co_spawn(context, deliver(*notifier, std::move(text)),
                       asio::bind_cancellation_slot(cancelled.slot(), std::move(finished)));
        context.poll();
    }

    /// What the notifier still sends until it closes the connection.
    static std::string rest_of(tcp::socket& peer)
    {
        std::string said;
        boost::system::error_code ended;
        asio::read(peer, asio::dynamic_buffer(said), ended);
        return said;
    }

    /// A mail server that accepts everything up to the text of the mail; returns its connection.
    tcp::socket accept_up_to_the_text()
    {
        auto peer = acceptor.accept();
        std::string said;
        for (auto const* reply :
             {"220 h\r\n", "250 h\r\n", "250 sender\r\n", "250 recipient\r\n", "354 go on\r\n"}) {
            asio::write(peer, asio::buffer(reply, std::strlen(reply)));
            if (*reply != '3')
                said.erase(0, asio::read_until(peer, asio::dynamic_buffer(said), "\r\n"));
        }
        return peer;
    }

    asio::io_context context{1};
    asio::cancellation_signal cancelled;
    tcp::acceptor acceptor{context, tcp::endpoint(asio::ip::address_v4::loopback(), 0)};
    std::unique_ptr<Notifier> notifier;
    std::optional<result<>> outcome;
};

} // namespace

BOOST_AUTO_TEST_CASE(without_libcurl_the_failure_names_the_library_and_its_package)
{
    auto const missing = adapters::LoadedCurl::load("libcurl.so.0");
    BOOST_TEST((missing.error() == errc::unavailable));
    auto const sentence = missing.error().message();
    BOOST_TEST(sentence.find("package libcurl4") != std::string::npos);
    BOOST_TEST(sentence.find("libcurl.so.0") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_library_without_the_functions_of_libcurl_is_refused)
{
    BOOST_TEST((adapters::LoadedCurl::load("libm.so.6").error() == errc::unavailable));
}

BOOST_AUTO_TEST_CASE(a_mail_server_that_says_nothing_is_given_up)
{
    Fixture fixture(200ms);
    fixture.begin();
    fixture.context.run();
    BOOST_TEST((fixture.outcome->error() == errc::timed_out));
    BOOST_TEST(fixture.outcome->error().message().find("timed out") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(cancelled_while_it_waits_it_closes_the_connection_and_ends)
{
    Fixture fixture;
    fixture.begin();
    auto peer = fixture.acceptor.accept();
    fixture.cancelled.emit(asio::cancellation_type::terminal);
    fixture.context.restart();
    fixture.context.run();
    BOOST_TEST((fixture.outcome->error().code() == asio::error::operation_aborted));
    BOOST_TEST(Fixture::rest_of(peer).empty());
}

BOOST_AUTO_TEST_CASE(cancelled_in_the_middle_of_the_text_half_a_mail_never_counts_as_one)
{
    Fixture fixture;
    fixture.begin(std::string(std::size_t{64} << 20, 'x')); // more than sockets buffer
    auto peer = fixture.accept_up_to_the_text();
    std::array<char, 1000> some{};
    asio::read(peer, asio::buffer(some));
    fixture.cancelled.emit(asio::cancellation_type::terminal);
    fixture.context.restart();
    fixture.context.run();
    auto const rest = Fixture::rest_of(peer);
    BOOST_TEST(rest.size() < (std::size_t{64} << 20));
    BOOST_TEST(rest.find("\r\n.\r\n") == std::string::npos);
    BOOST_TEST((fixture.outcome->error().code() == asio::error::operation_aborted));
}

BOOST_AUTO_TEST_CASE(cancelled_while_the_mail_server_says_no_goodbye_the_mail_is_delivered)
{
    Fixture fixture;
    fixture.begin();
    auto peer = fixture.accept_up_to_the_text();
    std::string said;
    said.erase(0, asio::read_until(peer, asio::dynamic_buffer(said), "\r\n.\r\n"));
    asio::write(peer, asio::buffer("250 taken\r\n", 11));
    asio::read_until(peer, asio::dynamic_buffer(said), "QUIT\r\n");
    fixture.cancelled.emit(asio::cancellation_type::terminal);
    fixture.context.restart();
    fixture.context.run();
    BOOST_TEST(fixture.outcome->has_value());
    BOOST_TEST(Fixture::rest_of(peer).empty());
}

BOOST_AUTO_TEST_CASE(cancelled_before_it_began_it_never_connects)
{
    Fixture fixture;
    auto finished = [&fixture](std::exception_ptr failure, result<> ended) {
        fixture.outcome = failure ? result<>(Failure(asio::error::operation_aborted)) : std::move(ended);
    };
    asio::co_spawn(fixture.context, deliver_late(*fixture.notifier),
                   asio::bind_cancellation_slot(fixture.cancelled.slot(), std::move(finished)));
    fixture.context.poll();
    fixture.cancelled.emit(asio::cancellation_type::terminal);
    fixture.context.run();
    BOOST_TEST((fixture.outcome->error().code() == asio::error::operation_aborted));
    fixture.acceptor.non_blocking(true);
    boost::system::error_code nobody;
    fixture.acceptor.accept(nobody);
    BOOST_TEST((nobody == asio::error::would_block));
}

BOOST_AUTO_TEST_CASE(a_mail_server_that_hangs_up_is_no_success)
{
    Fixture fixture;
    fixture.begin();
    fixture.acceptor.accept().close();
    fixture.context.restart();
    fixture.context.run();
    BOOST_TEST(fixture.outcome->has_error());
    BOOST_TEST(!fixture.outcome->error().message().empty());
}

BOOST_AUTO_TEST_CASE(a_greeting_that_refuses_is_quoted)
{
    for (auto const& [greeting, code] : {std::pair("421 4.3.2 try later\r\n", errc::unavailable),
                                         std::pair("554 go away\r\n", errc::refused)}) {
        Fixture fixture;
        fixture.begin();
        auto peer = fixture.acceptor.accept();
        asio::write(peer, asio::buffer(greeting, std::strlen(greeting)));
        fixture.context.restart();
        fixture.context.run();
        BOOST_TEST((fixture.outcome->error() == code), greeting);
        auto const quoted = '"' + std::string(greeting, std::strlen(greeting) - 2) + '"';
        BOOST_TEST(fixture.outcome->error().message() == "the mail server answered " + quoted);
    }
}

BOOST_AUTO_TEST_CASE(parameters_that_could_forge_a_mail_are_refused)
{
    MailConfig good;
    good.server = "localhost";
    good.sender = "from@a.org";
    good.administrator = "to@b.org";
    BOOST_TEST(make_smtp_notifier(good).has_value());
    for (auto const member : {&MailConfig::server, &MailConfig::sender, &MailConfig::administrator}) {
        auto bad = good;
        bad.*member = "a@b.org\r\nRCPT TO:<c@d.org>";
        BOOST_TEST((make_smtp_notifier(bad).error() == errc::invalid_argument));
    }
}

BOOST_AUTO_TEST_SUITE_END()
