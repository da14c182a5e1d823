// One mail to one mail server with libcurl, on a thread that may wait, ended at once from any other.
#pragma once

#include "loaded_curl.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>

#include <array>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::adapters {

/// Used once. Its destructor leaves nothing running.
class SmtpExchange
{
public:
    /// `own_name` is what we say in EHLO, if it is a name of a host; `message` is the whole mail, its lines
    /// ending with CRLF. Empty: no mail is sent, but everything before it is tried: connection, TLS and
    /// login.
    SmtpExchange(LoadedCurl const& curl, MailConfig mail, std::string own_name, std::string message);
    SmtpExchange(SmtpExchange const&) = delete;
    ~SmtpExchange();

    /// Waits for the mail server's final reply.   Errors: those of `Notifier::deliver`.
    result<> perform();

    /// Makes `perform` return `operation_aborted`, at once.   Thread-safety: any thread.
    void abort();

private:
    static curl_socket_t on_open(void* user, curlsocktype purpose, curl_sockaddr* address);
    static int on_close(void* user, curl_socket_t socket);
    static std::size_t on_read(char* into, std::size_t size, std::size_t count, void* user);
    static std::size_t on_reply(char* line, std::size_t size, std::size_t count, void* user);

    void prepare();
    void prepare_sockets();
    void prepare_security();
    bool take_reply(std::string_view line);
    result<> drive();
    bool is_aborted();
    void shut_down_sockets();
    CURLcode result_of_transfer();
    Failure failure_of(CURLcode code) const;

    LoadedCurl const curl_;
    MailConfig const mail_;
    std::string const own_name_;
    std::string message_;
    CURLM* multi_;
    CURL* easy_;
    curl_slist* recipients_ = nullptr;
    std::array<char, CURL_ERROR_SIZE> words_{};
    std::string_view unsent_;
    std::string
        refusal_; // the last reply of code 4xx or 5xx: libcurl says QUIT after it, and gets another reply
    int greetings_ = 0; // replies of code 220: the first is the greeting, the second says that TLS may begin
    bool offers_login_ = false; // in the reply to the EHLO under TLS
    bool has_no_login_ = false;
    std::mutex mutex_; // guards what follows
    bool aborted_ = false;
    std::vector<curl_socket_t> sockets_;
};

} // namespace webots_cloud::adapters
