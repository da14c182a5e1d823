#include "mail.hpp"

namespace webots_cloud::app {

SmtpParams smtp_params(SessionConfig const& config)
{
    SmtpParams params;
    params.mail = config.mail;
    params.own_name = config.address.host;
    return params;
}

} // namespace webots_cloud::app
