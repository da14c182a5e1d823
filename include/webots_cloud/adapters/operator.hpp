// How a server knows its operator: the socket on the machine, and the token.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A Unix socket on which the operator asks what nobody else may: every request there is
/// `IncomingRequest::is_operator`.
///
/// Lifetime: must outlive its operations: await their end before it is destroyed.
class OperatorSocket
{
public:
    virtual ~OperatorSocket() = default;

    /// Errors: `unavailable`, naming the socket. The server can do without: `run` then only waits for its
    /// cancellation.
    virtual result<> listen() = 0;

    /// Has `endpoint` answer until cancelled.
    ///
    /// Lifetime: `endpoint` must outlive the operation.
    /// Errors: `operation_aborted`.
    virtual boost::asio::awaitable<result<>> run(Endpoint& endpoint) = 0;
};

/// Only root and the user of this process are answered, and of their processes none that this one has
/// started, such as simulations. A socket that a dead server has left is replaced.
std::unique_ptr<OperatorSocket> make_operator_socket(boost::asio::any_io_executor executor,
                                                     std::filesystem::path path, Logger log);

/// What tells the operator's token from other words. `file` has one line: the token, or `sha256:` and the 64
/// hexadecimal digits of its SHA-256, so that the file does not give the token away.
///
/// Errors: `invalid_config`: the file can't be read, others may read it too, or a token is shorter than 16
/// characters.
result<std::function<bool(std::string_view token)>>
make_operator_token_check(std::filesystem::path const& file);

} // namespace webots_cloud
