// Mail to the operator.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/notifier.hpp>

#include <cstdint>
#include <memory>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A mailbox of the operator, and the mail server that takes mails for it.
struct SmtpParams
{
    SmtpParams() = default;

    MailConfig mail;                                    ///< The server, and who writes to whom.
    std::string own_name = "localhost";                 ///< What we call ourselves in EHLO.
    Duration connect_timeout = std::chrono::seconds(5); ///< For the name and the connection.
    Duration timeout =
        std::chrono::seconds(20); ///< For the whole mail; some mail servers greet slowly on purpose.
};

/// E-mail over SMTP with libcurl, loaded by this. Certificates are verified against those of this computer,
/// or of the file that `SSL_CERT_FILE` names.
/// Errors: `invalid_argument`: host, sender or recipient is unusable; `unavailable`: no libcurl.
result<std::unique_ptr<Notifier>> make_smtp_notifier(SmtpParams params);

} // namespace webots_cloud
