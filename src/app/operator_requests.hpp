// The operator's socket and the access rules, which are the same for both servers.
#pragma once

#include <webots_cloud/access_control.hpp>
#include <webots_cloud/adapters/operator.hpp>
#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::app {

/// Where a server puts its operator's socket: `operatorSocket`, or `<kind>-<port>.sock` in the folder that
/// systemd made for the service (`RUNTIME_DIRECTORY`), the user's (`XDG_RUNTIME_DIR`/webots_cloud) or one in
/// the folder for temporary files.
std::filesystem::path operator_socket(std::string_view kind, std::uint16_t port, AccessConfig const& access);

/// Where the socket of a server that runs with this configuration is, seen by other programs, which do not
/// have the service's environment.
std::filesystem::path find_operator_socket(std::string_view kind, std::uint16_t port,
                                           AccessConfig const& access);

/// The operator's socket, which listens. Without it the server runs all the same: `missing`, which the log
/// says then, as in "--drain".
std::unique_ptr<OperatorSocket> open_operator_socket(boost::asio::any_io_executor const& executor,
                                                     std::string_view kind, std::uint16_t port,
                                                     AccessConfig const& access, std::string_view missing,
                                                     Logger const& log);

/// The names by which browsers may address this machine.
std::vector<std::string> machine_names();

/// The check of `operatorTokenFile`; empty where no such file is named, or is there.
///
/// Errors: as `make_operator_token_check`.
result<OperatorTokenCheck> operator_token_check(AccessConfig const& access);

} // namespace webots_cloud::app
