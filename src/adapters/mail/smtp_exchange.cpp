// libcurl speaks SMTP, but waits where it likes. Here its sockets are ours, so that an exchange ends at once
// when the server stops, and a mail server that is slow on purpose costs a thread and no more.
#include "smtp_exchange.hpp"

#include "core/notices/mail_message.hpp"
#include "core/text.hpp"

#include <boost/asio/error.hpp>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sys/socket.h>
#include <unistd.h>
#include <utility>

namespace webots_cloud::adapters {
namespace {

using core::concat;

constexpr int max_nap = 1000; // ms: timers of libcurl end it earlier, and so does abort()

long milliseconds(Duration duration)
{
    return static_cast<long>(std::chrono::duration_cast<std::chrono::milliseconds>(duration).count());
}

/// RFC 8314, 3.3: at this port TLS begins with the first byte, and nothing is greeted before.
bool speaks_tls_at_once(MailConfig const& mail) noexcept
{
    constexpr int submissions = 465;
    return mail.server_port == submissions;
}

/// The last path segment is what EHLO says.
std::string url_of(MailConfig const& mail, std::string const& own_name)
{
    bool const is_ipv6 = mail.server.find(':') != std::string::npos;
    auto const host = is_ipv6 ? concat("[", mail.server, "]") : mail.server;
    return concat(speaks_tls_at_once(mail) ? "smtps://" : "smtp://", host, ":",
                  std::to_string(mail.server_port == 0 ? 25 : mail.server_port), "/",
                  core::is_mail_host(own_name) ? own_name : "localhost"); // it greets, no more
}

bool is_last_line(std::string_view reply)
{
    return reply.size() < 4 || reply[3] != '-';
}

} // namespace

SmtpExchange::SmtpExchange(LoadedCurl const& curl, MailConfig mail, std::string own_name, std::string message)
    : curl_(curl), mail_(std::move(mail)), own_name_(std::move(own_name)), message_(std::move(message)),
      multi_(curl_.multi_init()), easy_(curl_.easy_init()), unsent_(message_)
{}

SmtpExchange::~SmtpExchange()
{
    curl_.easy_cleanup(easy_);
    curl_.multi_cleanup(multi_);
    curl_.slist_free_all(recipients_);
}

void SmtpExchange::abort()
{
    {
        // In one go: once we are seen to have given up, no connection may be alive.
        std::lock_guard const lock(mutex_);
        aborted_ = true;
        shut_down_sockets();
    }
    curl_.multi_wakeup(multi_);
}

bool SmtpExchange::is_aborted()
{
    std::lock_guard const lock(mutex_);
    return aborted_;
}

/// Ends every connection under libcurl's hands, which waits for the last words of a mail server (and, worse,
/// says the end of a mail that we gave up in the middle) wherever it finds the connection alive. With the
/// mutex.
void SmtpExchange::shut_down_sockets()
{
    for (auto const socket : sockets_)
        ::shutdown(socket, SHUT_RDWR);
}

result<> SmtpExchange::perform()
{
    // A mail server that hangs up while OpenSSL writes must not end the program; the thread is our own.
    sigset_t broken_pipe;
    sigemptyset(&broken_pipe);
    sigaddset(&broken_pipe, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &broken_pipe, nullptr);
    prepare();
    curl_.multi_add_handle(multi_, easy_);
    auto const outcome = drive();
    curl_.multi_remove_handle(multi_, easy_);
    return outcome;
}

void SmtpExchange::prepare()
{
    curl_.easy_setopt(easy_, CURLOPT_URL, url_of(mail_, own_name_).c_str());
    curl_.easy_setopt(easy_, CURLOPT_PROTOCOLS_STR, "smtp,smtps");
    curl_.easy_setopt(easy_, CURLOPT_PROXY, ""); // proxies of the environment are for the web
    curl_.easy_setopt(easy_, CURLOPT_NOSIGNAL, 1L);
    curl_.easy_setopt(easy_, CURLOPT_NETRC, static_cast<long>(CURL_NETRC_IGNORED));
    // A name that is still being looked up when we give up is left to its thread: waiting for that could take
    // half a minute.
    curl_.easy_setopt(easy_, CURLOPT_QUICK_EXIT, 1L);
    curl_.easy_setopt(easy_, CURLOPT_TIMEOUT_MS, milliseconds(mail_.timeout));
    curl_.easy_setopt(easy_, CURLOPT_CONNECTTIMEOUT_MS, milliseconds(mail_.timeout)); // see drive()
    curl_.easy_setopt(easy_, CURLOPT_ERRORBUFFER, words_.data());
    prepare_sockets();
    prepare_security();

    curl_.easy_setopt(easy_, CURLOPT_HEADERFUNCTION, &SmtpExchange::on_reply);
    curl_.easy_setopt(easy_, CURLOPT_HEADERDATA, this);
    if (message_.empty()) {
        curl_.easy_setopt(easy_, CURLOPT_CONNECT_ONLY, 1L);
        return;
    }
    recipients_ = curl_.slist_append(nullptr, concat("<", mail_.administrator, ">").c_str());
    curl_.easy_setopt(easy_, CURLOPT_MAIL_FROM, concat("<", mail_.sender, ">").c_str());
    curl_.easy_setopt(easy_, CURLOPT_MAIL_RCPT, recipients_);
    curl_.easy_setopt(easy_, CURLOPT_UPLOAD, 1L);
    curl_.easy_setopt(easy_, CURLOPT_READFUNCTION, &SmtpExchange::on_read);
    curl_.easy_setopt(easy_, CURLOPT_READDATA, this);
}

void SmtpExchange::prepare_sockets()
{
    curl_.easy_setopt(easy_, CURLOPT_OPENSOCKETFUNCTION, &SmtpExchange::on_open);
    curl_.easy_setopt(easy_, CURLOPT_OPENSOCKETDATA, this);
    curl_.easy_setopt(easy_, CURLOPT_CLOSESOCKETFUNCTION, &SmtpExchange::on_close);
    curl_.easy_setopt(easy_, CURLOPT_CLOSESOCKETDATA, this);
    // QUIT then belongs to this mail, and the limit for its answer is ours.
    curl_.easy_setopt(easy_, CURLOPT_FORBID_REUSE, 1L);
    curl_.easy_setopt(easy_, CURLOPT_SERVER_RESPONSE_TIMEOUT,
                      std::max(1L, milliseconds(mail_.timeout) / 1000));
}

/// With a password, or at the port for TLS: TLS or nothing, and a certificate that is valid for the host.
/// Otherwise neither.
void SmtpExchange::prepare_security()
{
    bool const logs_in = !mail_.password.empty();
    if (!logs_in && !speaks_tls_at_once(mail_))
        return;
    curl_.easy_setopt(easy_, CURLOPT_USE_SSL, static_cast<long>(CURLUSESSL_ALL));
    curl_.easy_setopt(easy_, CURLOPT_SSL_VERIFYPEER, 1L);
    curl_.easy_setopt(easy_, CURLOPT_SSL_VERIFYHOST, 2L);
    curl_.easy_setopt(easy_, CURLOPT_SSLVERSION, static_cast<long>(CURL_SSLVERSION_TLSv1_2));
    // OpenSSL's own variable, which all other TLS here uses; only libcurl does not.
    if (char const* const trusted = std::getenv("SSL_CERT_FILE"))
        curl_.easy_setopt(easy_, CURLOPT_CAINFO, trusted);
    if (!logs_in)
        return;
    curl_.easy_setopt(easy_, CURLOPT_USERNAME, mail_.user.c_str());
    curl_.easy_setopt(easy_, CURLOPT_PASSWORD, mail_.password.c_str());
}

/// Until the transfer ends, or we are told to, or there is no connection in time.
///
/// libcurl's own limit for connecting goes on until the login is over; a mail server may greet slowly on
/// purpose, though.
result<> SmtpExchange::drive()
{
    auto const connected_by = std::chrono::steady_clock::now() + mail_.connect_timeout;
    for (;;) {
        int running = 0;
        if (auto const code = curl_.multi_perform(multi_, &running); code != CURLM_OK)
            return Failure(errc::unreachable, curl_.multi_strerror(code));
        if (running == 0)
            break;
        if (is_aborted())
            return Failure(boost::asio::error::operation_aborted);
        curl_off_t connected = 0;
        curl_.easy_getinfo(easy_, CURLINFO_CONNECT_TIME_T, &connected);
        auto const left = milliseconds(connected_by - std::chrono::steady_clock::now());
        if (connected == 0 && left <= 0) {
            std::lock_guard const lock(mutex_);
            shut_down_sockets();
            return Failure(errc::timed_out, concat("no connection to ", mail_.server, " in time"));
        }
        auto const nap = connected == 0 ? std::min<long>(left + 1, max_nap) : max_nap;
        curl_.multi_poll(multi_, nullptr, 0, static_cast<int>(nap), nullptr);
    }
    auto const code = result_of_transfer();
    if (code != CURLE_OK && is_aborted())
        return Failure(boost::asio::error::operation_aborted);
    return code == CURLE_OK ? result<>() : failure_of(code);
}

CURLcode SmtpExchange::result_of_transfer()
{
    int left = 0;
    auto const* const message = curl_.multi_info_read(multi_, &left);
    return message ? message->data.result : CURLE_FAILED_INIT;
}

Failure SmtpExchange::failure_of(CURLcode code) const
{
    if (has_no_login_)
        return {errc::refused, concat(mail_.server, " offers no login")};
    auto detail = std::string(words_[0] ? words_.data() : curl_.easy_strerror(code));
    if (code == CURLE_OPERATION_TIMEDOUT)
        return {errc::timed_out, detail};
    if (code == CURLE_PEER_FAILED_VERIFICATION || code == CURLE_SSL_CONNECT_ERROR ||
        code == CURLE_COULDNT_RESOLVE_HOST || code == CURLE_COULDNT_CONNECT || code == CURLE_USE_SSL_FAILED)
        return {errc::unreachable, detail};
    if (!refusal_.empty())
        return {refusal_[0] == '4' ? errc::unavailable : errc::refused,
                concat("the mail server answered \"", core::printable(refusal_, 200), "\"")};
    if (code == CURLE_WEIRD_SERVER_REPLY)
        return {errc::protocol_error, detail};
    return {errc::unreachable, detail};
}

curl_socket_t SmtpExchange::on_open(void* user, curlsocktype, curl_sockaddr* address)
{
    auto& exchange = *static_cast<SmtpExchange*>(user);
    std::lock_guard const lock(exchange.mutex_);
    if (exchange.aborted_) // nothing would close this connection any more
        return CURL_SOCKET_BAD;
    auto const socket = ::socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
    if (socket >= 0)
        exchange.sockets_.push_back(socket);
    return socket;
}

int SmtpExchange::on_close(void* user, curl_socket_t socket)
{
    auto& exchange = *static_cast<SmtpExchange*>(user);
    std::lock_guard const lock(exchange.mutex_);
    std::erase(exchange.sockets_, socket);
    return ::close(socket);
}

std::size_t SmtpExchange::on_read(char* into, std::size_t size, std::size_t count, void* user)
{
    auto& unsent = static_cast<SmtpExchange*>(user)->unsent_;
    auto const bytes = std::min(size * count, unsent.size());
    std::memcpy(into, unsent.data(), bytes);
    unsent.remove_prefix(bytes);
    return bytes;
}

std::size_t SmtpExchange::on_reply(char* line, std::size_t size, std::size_t count, void* user)
{
    auto const bytes = size * count;
    return static_cast<SmtpExchange*>(user)->take_reply(core::trim(std::string_view(line, bytes))) ? bytes
                                                                                                   : 0;
}

/// One line of the mail server's. False ends the exchange.
///
/// libcurl would send the mail without a login where none is offered: an operator who set a password wants to
/// know.
bool SmtpExchange::take_reply(std::string_view line)
{
    if (line.starts_with('4') || line.starts_with('5'))
        refusal_ = line;
    if (line.starts_with("220") && is_last_line(line))
        ++greetings_;
    // Where TLS begins in the middle, the server says 220 once more, and what it offered before counts no
    // more.
    int const last_greeting = speaks_tls_at_once(mail_) ? 1 : 2;
    if (mail_.password.empty() || greetings_ != last_greeting || !line.starts_with("250") || line.size() < 4)
        return true;
    offers_login_ = offers_login_ || line.substr(4).starts_with("AUTH");
    if (!is_last_line(line))
        return true;
    ++greetings_; // what follows is no reply to EHLO
    has_no_login_ = !offers_login_;
    return offers_login_;
}

} // namespace webots_cloud::adapters
