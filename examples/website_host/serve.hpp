// The website as a server of its own: its event loop, until somebody ends it.
#pragma once

#include "configuration.hpp"
#include "page.hpp"

#include <webots_cloud/error.hpp>

#include <string>

namespace website_host {

/// Serves until SIGINT or SIGTERM. Says on standard output where it listens, and logs there. `key`: that by
/// which simulation servers know us.
///
/// Errors: those of `HttpServer::listen`, and of a log that can't be opened.
webots_cloud::result<> serve(Configuration configuration, Page page, std::string key);

} // namespace website_host
