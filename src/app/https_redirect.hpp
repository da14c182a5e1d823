// The key `redirectPort`: a port without TLS that leads to the one with TLS.
#pragma once

#include <webots_cloud/config.hpp>
#include <webots_cloud/error.hpp>
#include <webots_cloud/public_address.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <memory>

namespace webots_cloud::app {

/// Connections to that port. They are answered at once, and must not take the descriptors of others.
inline constexpr std::size_t max_redirected = 128;

/// What the other port has to leave for them.
std::size_t descriptors_of_redirect(NetworkConfig const& network);

class HttpsRedirect
{
public:
    HttpsRedirect(boost::asio::any_io_executor executor, PublicAddress const& address,
                  NetworkConfig const& network, AccessConfig const& access, Logger log);
    ~HttpsRedirect();

    /// Errors: `unavailable`, naming the port.
    result<> listen();

    /// Without `redirectPort` it only waits for its cancellation.
    ///
    /// Cancellation: terminal.
    /// Errors: `operation_aborted`.
    boost::asio::awaitable<result<>> run();

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

} // namespace webots_cloud::app
