// Whether a web server is there, for the doctor.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <string>

namespace webots_cloud::adapters {

/// Whether anybody answers at a URL to what fetches projects: by way of the proxy that the environment names,
/// if it does. The status of the answer, whatever it is. Blocks.
///
/// Errors: `unreachable`, `timed_out`.
/// Thread-safety: any thread.
result<int> try_web_server(std::string const& url, Duration timeout);

} // namespace webots_cloud::adapters
