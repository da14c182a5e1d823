// The key `sessionSecret`: tickets are made by session servers, and accepted by simulation servers.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::app {

/// For `SessionServiceHooks::make_ticket`; empty without a secret.
///
/// Lifetime: the clock must outlive the function.
/// Errors: as `make_ticket_mac`.
result<std::function<std::string(std::string_view server)>> ticket_maker(SessionConfig const& config,
                                                                         Clock& clock);

/// For `SimulationServiceHooks::refuse_ticket`; empty without a secret.
///
/// Lifetime: the clock must outlive the function.
/// Errors: as `make_ticket_mac`.
result<std::function<std::optional<Failure>(std::string_view ticket)>>
ticket_check(SimulationConfig const& config, Clock& clock, Logger log);

} // namespace webots_cloud::app
