#include "unit_test.hpp"

#include "core/notices/mail_message.hpp"

using namespace webots_cloud;
using namespace std::chrono_literals;

// Protocol section 10, and RFC 5322.
BOOST_AUTO_TEST_SUITE(mail_message)

namespace {

constexpr auto new_year = WallTime(std::chrono::sys_days(std::chrono::year(2026) / 1 / 1));

Notice notice(std::string subject, std::string text)
{
    Notice notice(std::move(subject), std::move(text));
    notice.written = new_year + 13h + 2min + 3s + 999ms;
    notice.id = "1767.1.webots";
    return notice;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_message_has_the_headers_that_mail_systems_expect_and_crlf)
{
    BOOST_TEST(core::mail_message(notice("It is down", "Hello,\n\n.\nBye\n"), "from@a.org", "to@b.org") ==
               "Date: Thu, 01 Jan 2026 13:02:03 +0000\r\n"
               "From: Simulation Server <from@a.org>\r\n"
               "To: Administrator <to@b.org>\r\n"
               "Subject: It is down\r\n"
               "Message-ID: <1767.1.webots@a.org>\r\n"
               "MIME-Version: 1.0\r\n"
               "Content-Type: text/plain; charset=utf-8\r\n"
               "Content-Transfer-Encoding: 7bit\r\n"
               "Auto-Submitted: auto-generated\r\n"
               "\r\n"
               "Hello,\r\n\r\n.\r\nBye\r\n");
}

BOOST_AUTO_TEST_CASE(no_value_adds_a_header)
{
    auto evil = notice("a\r\nBcc: all@c.org\r\n\r\nb", "text\n");
    evil.id = "x>\r\nX-Evil: 1";
    auto const message = core::mail_message(evil, "from@a.org\r\nX-Evil: 2", "to@b.org\nX-Evil: 3");
    BOOST_TEST(message.find("\r\nBcc:") == std::string::npos);
    BOOST_TEST(message.find("\nX-Evil") == std::string::npos);
    BOOST_TEST(message.ends_with("\r\n\r\ntext\r\n"));
    BOOST_TEST(message.find("\r\n\r\n") == message.size() - 10);
}

BOOST_AUTO_TEST_CASE(text_beyond_ascii_is_announced)
{
    auto const message = core::mail_message(notice("s", "d\xC3\xA9j\xC3\xA0\r\n"), "root", "to@b.org");
    BOOST_TEST(message.find("Content-Transfer-Encoding: 8bit\r\n") != std::string::npos);
    BOOST_TEST(message.find("@localhost>\r\n") != std::string::npos);
    BOOST_TEST(message.ends_with("d\xC3\xA9j\xC3\xA0\r\n"));
}

BOOST_AUTO_TEST_CASE(addresses_are_plain_ones)
{
    for (auto const* good : {"admin@cyberbotics.com", "root", "a.b+c@d-e.org"})
        BOOST_TEST(core::is_mail_address(good), good);
    for (auto const* bad :
         {"", "a@[1]", "a b@c", "a@b\r\nDATA", "<a@b>", "a@b,c@d", "@b", "a@", "\"a\"@b", "d\xC3\xA9@b"})
        BOOST_TEST(!core::is_mail_address(bad), bad);
    BOOST_TEST(!core::is_mail_address(std::string(300, 'a')));
}

BOOST_AUTO_TEST_CASE(hosts_are_names_and_numbers)
{
    for (auto const* good : {"mail.infomaniak.com", "localhost", "127.0.0.1", "::1", "fe80::1", "mail_1"})
        BOOST_TEST(core::is_mail_host(good), good);
    for (auto const* bad : {"", "mail:25", "mail/x", "a b", "a@b", "-x", "a\r\nb", "m%C3"})
        BOOST_TEST(!core::is_mail_host(bad), bad);
}

BOOST_AUTO_TEST_SUITE_END()
