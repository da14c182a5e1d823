// The counters of adapters and mails, for `GET /metrics`.
#pragma once

#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/operator_mail.hpp>

#include <string>

namespace webots_cloud::app {

/// In the text format of Prometheus; names begin with `webots_http_`.
std::string http_server_metrics(HttpServerStatistics const& statistics);

/// Likewise; names begin with `webots_mail`.
std::string mail_metrics(OperatorMailStatistics const& statistics);

} // namespace webots_cloud::app
