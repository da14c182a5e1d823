// Whether a mail server takes our mails, for the doctor.
#pragma once

#include <webots_cloud/adapters/mail.hpp>
#include <webots_cloud/error.hpp>

namespace webots_cloud::adapters {

/// Connects to a mail server as for a mail, with STARTTLS and the login where there is a password, and says
/// goodbye. No mail is sent. Blocks.
///
/// Errors: as of `Notifier::deliver`.
/// Thread-safety: any thread.
result<> try_mail_server(SmtpParams params);

} // namespace webots_cloud::adapters
