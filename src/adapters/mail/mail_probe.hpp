// Whether a mail server takes our mails, for the doctor.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>

#include <string>

namespace webots_cloud::adapters {

/// Connects to a mail server as for a mail, with STARTTLS and the login where there is a password, and says
/// goodbye. No mail is sent. Blocks.
///
/// Errors: as of `Notifier::deliver`.
/// Thread-safety: any thread.
result<> try_mail_server(MailConfig mail, std::string own_name);

} // namespace webots_cloud::adapters
