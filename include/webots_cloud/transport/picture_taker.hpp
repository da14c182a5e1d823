// Pictures of simulations, as a seam.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Asks simulators for what their browsers see.
class PictureTaker
{
public:
    virtual ~PictureTaker() = default;

    /// One JPEG of a simulator that streams pictures. It takes some seconds at most.
    ///
    /// Cancellation: none.
    /// Errors: `unreachable`; `timed_out`; `protocol_error`: it has no picture, or one of too many bytes.
    virtual boost::asio::awaitable<result<std::string>> take(Upstream simulator) = 0;
};

} // namespace webots_cloud
