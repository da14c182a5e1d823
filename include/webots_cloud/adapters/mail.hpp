// Mail to the operator.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/notifier.hpp>

#include <memory>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// E-mail over SMTP with libcurl, loaded by this. Certificates are verified against those of this computer,
/// or of the file that `SSL_CERT_FILE` names. `own_name`: what we call ourselves in EHLO.
/// Errors: `invalid_argument`: host, sender or recipient is unusable; `unavailable`: no libcurl.
result<std::unique_ptr<Notifier>> make_smtp_notifier(MailConfig mail, std::string own_name = "localhost");

} // namespace webots_cloud
