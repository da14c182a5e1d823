#include "mail_probe.hpp"

#include "smtp_exchange.hpp"

#include "core/notices/mail_message.hpp"

#include <utility>

namespace webots_cloud::adapters {

result<> try_mail_server(MailConfig mail, std::string own_name)
{
    if (!core::is_mail_host(mail.server))
        return Failure(errc::invalid_argument, "the mail server is not a host name");
    auto const curl = LoadedCurl::load();
    if (!curl)
        return curl.error();
    SmtpExchange exchange(*curl, std::move(mail), std::move(own_name), {});
    return exchange.perform();
}

} // namespace webots_cloud::adapters
