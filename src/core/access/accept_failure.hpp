// What an operator is told of a connection that could not be accepted.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// For the log: what is used up, and what to do.   `what`: "a connection", say.   `error`: an `errno`.
std::string describe_accept_failure(std::string_view what, int error);

} // namespace webots_cloud::core
