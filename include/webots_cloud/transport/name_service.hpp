// Looks names up: the addresses of a name, and where a service runs.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/name_answer.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Names as this machine knows them.
///
/// Thread-safety: one executor.
class NameService
{
public:
    virtual ~NameService() = default;

    /// Never an answer without addresses.
    ///
    /// Cancellation: terminal.
    /// Errors: `not_found`: a name server says that there are none; `unreachable`, also when there is no
    /// answer at `deadline`; `protocol_error`; `operation_aborted`.
    virtual boost::asio::awaitable<result<NameAnswer>> addresses(std::string name, TimePoint deadline) = 0;

    /// The same for services, as of `_webots._tcp.example.org`.
    virtual boost::asio::awaitable<result<NameAnswer>> services(std::string name, TimePoint deadline) = 0;
};

} // namespace webots_cloud
