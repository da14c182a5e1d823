#include "mail_probe.hpp"

#include "smtp_exchange.hpp"

#include "core/notices/mail_message.hpp"

#include <utility>

namespace webots_cloud::adapters {

result<> try_mail_server(SmtpParams params)
{
    if (!core::is_mail_host(params.mail.server))
        return Failure(errc::invalid_argument, "the mail server is not a host name");
    if (!core::is_mail_host(params.own_name))
        params.own_name = "localhost"; // it greets, no more
    auto const curl = LoadedCurl::load();
    if (!curl)
        return curl.error();
    SmtpExchange exchange(*curl, std::move(params), {});
    return exchange.perform();
}

} // namespace webots_cloud::adapters
