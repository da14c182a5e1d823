#include "smtp_exchange.hpp"

#include "core/notices/mail_message.hpp"

#include <webots_cloud/probes.hpp>

#include <utility>

namespace webots_cloud {

result<> try_mail_server(SmtpParams params)
{
    if (!core::is_mail_host(params.mail.server))
        return Failure(errc::invalid_argument, "the mail server is not a host name");
    if (!core::is_mail_host(params.own_name))
        params.own_name = "localhost"; // it greets, no more
    auto const curl = adapters::LoadedCurl::load();
    if (!curl)
        return curl.error();
    adapters::SmtpExchange exchange(*curl, std::move(params), {});
    return exchange.perform();
}

} // namespace webots_cloud
