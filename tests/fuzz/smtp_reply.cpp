// What mail servers reply: whatever it is, the mail is said once and to one recipient, no password is said
// without TLS, and a failure is one printable sentence.
#include "fuzz.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "adapters/mail/smtp_exchange.hpp"
#include "core/notices/mail_message.hpp"
#include "core/text.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>

#include <string>
#include <thread>

using namespace webots_cloud;
using adapters::FileDescriptor;

namespace {

constexpr std::string_view sender = "from@a.org";
constexpr std::string_view recipient = "to@b.org";

/// Says everything at once to the first who comes, and hears them out.
class MailServer
{
public:
    MailServer() : listening_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0))
    {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t length = sizeof address;
        fuzz::require(::bind(listening_.get(), reinterpret_cast<sockaddr*>(&address), length) == 0);
        fuzz::require(::listen(listening_.get(), 5) == 0);
        fuzz::require(::getsockname(listening_.get(), reinterpret_cast<sockaddr*>(&address), &length) == 0);
        port_ = ntohs(address.sin_port);
        timeval const patience{30, 0};
        fuzz::require(::setsockopt(listening_.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) ==
                      0);
    }

    std::uint16_t port() const { return port_; }

    std::string serve(std::string_view replies) const
    {
        FileDescriptor const guest(::accept(listening_.get(), nullptr, nullptr));
        fuzz::require(guest.get() >= 0);
        while (!replies.empty()) {
            auto const sent = ::send(guest.get(), replies.data(), replies.size(), MSG_NOSIGNAL);
            if (sent <= 0)
                break;
            replies.remove_prefix(static_cast<std::size_t>(sent));
        }
        ::shutdown(guest.get(), SHUT_WR);
        std::string heard;
        char bytes[4096];
        for (auto read = ::recv(guest.get(), bytes, sizeof bytes, 0); read > 0;
             read = ::recv(guest.get(), bytes, sizeof bytes, 0))
            heard.append(bytes, static_cast<std::size_t>(read));
        return heard;
    }

private:
    FileDescriptor listening_;
    std::uint16_t port_ = 0;
};

std::size_t count(std::string_view text, std::string_view word)
{
    std::size_t found = 0;
    for (auto at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1))
        ++found;
    return found;
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    static auto const curl = adapters::LoadedCurl::load().value();
    static MailServer const server;
    auto replies = fuzz::text_of(data, size);
    bool const has_password = fuzz::take_byte(replies) % 2 == 1;
    MailConfig mail;
    mail.server = "127.0.0.1";
    mail.server_port = server.port();
    mail.sender = sender;
    mail.administrator = recipient;
    if (has_password) {
        mail.user = "user";
        mail.password = "password";
    }
    Notice notice("Subject", "Text of the mail\n");
    adapters::SmtpExchange exchange(curl, mail, "localhost", core::mail_message(notice, sender, recipient));
    std::string heard;
    std::thread listening([&] { heard = server.serve(replies); });
    auto const sent = exchange.perform();
    exchange.abort(); // whatever libcurl keeps open: the server hears the end
    listening.join();

    if (!sent) {
        auto const message = sent.error().message();
        fuzz::require(!message.empty() && message.size() < 1000 && core::is_printable(message));
    }
    fuzz::require(count(heard, "MAIL FROM:") <= 1 && count(heard, "RCPT TO:") <= 1);
    fuzz::require(count(heard, "MAIL FROM:") == count(heard, "MAIL FROM:<from@a.org>"));
    fuzz::require(count(heard, "RCPT TO:") == count(heard, "RCPT TO:<to@b.org>"));
    if (has_password)
        fuzz::require(!sent && heard.find("AUTH") == std::string::npos &&
                      heard.find("MAIL FROM") == std::string::npos);
    if (sent)
        fuzz::require(count(heard, "Text of the mail\r\n.\r\n") == 1 && count(replies, "354") >= 1);
    return 0;
}
