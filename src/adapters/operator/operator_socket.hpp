// Asks the server at an operator's socket, for programs that have no event loop.
#pragma once

#include <webots_cloud/error.hpp>

#include <filesystem>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// The body of the answer to a request over the operator's socket of a running server. Waits for it, 5 s at
/// most.
///
/// Errors: `invalid_argument`: the server refuses the request, in its own words, or the path is too long;
/// `unreachable`: no server is there; `refused`, `timed_out`; as of `find_watches`.
result<std::string> ask_operator_socket(std::filesystem::path const& path, std::string_view method,
                                        std::string_view target);

} // namespace webots_cloud::adapters
