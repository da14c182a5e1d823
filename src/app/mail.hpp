// The mail server that the configuration names.
#pragma once

#include <webots_cloud/adapters/mail.hpp>
#include <webots_cloud/config.hpp>

namespace webots_cloud::app {

/// With the default timeout.
SmtpParams smtp_params(SessionConfig const& config);

} // namespace webots_cloud::app
