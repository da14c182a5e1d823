#include "mail.hpp"

namespace webots_cloud::app {

SmtpParams smtp_params(SessionConfig const& config)
{
    SmtpParams params;
    params.host = config.mail_server;
    params.port = config.mail_server_port;
    params.sender = config.mail_sender;
    params.recipient = config.administrator;
    params.user = config.mail_sender_user;
    params.password = config.mail_sender_password;
    params.own_name = config.address.host;
    return params;
}

} // namespace webots_cloud::app
