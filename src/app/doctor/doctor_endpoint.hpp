// What a running server tells of its health: to its operator at `/api/doctor`, and who it is to everybody.
#pragma once

#include "app/endpoint_in_front.hpp"
#include "core/doctor/finding.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/steady_timer.hpp>

#include <functional>
#include <string>
#include <string_view>

namespace webots_cloud::app {

/// The header of `/livez` that tells servers from each other: a word that is made anew at each start.
inline constexpr std::string_view instance_header = "Webots-Cloud-Instance";

/// Stands before a service, behind the access control.
///
/// Lifetime: the clock must outlive it, too.   Thread-safety: one executor.
class DoctorEndpoint final : public EndpointInFront
{
public:
    using Look = std::function<boost::asio::awaitable<core::Findings>()>;

    DoctorEndpoint(boost::asio::any_io_executor executor, Endpoint& service, Clock& clock);

    /// The word of this server.
    std::string const& instance() const { return instance_; }

    /// Has `look` look whenever the operator asks and the last time was a while ago.
    /// Cancellation: terminal.
    boost::asio::awaitable<result<>> run(Look look);

    Answer respond(IncomingRequest const& request) override;

private:
    Answer report(IncomingRequest const& request);

    Clock& clock_;
    std::string const instance_;
    core::Examination examination_;
    TimePoint fresh_until_; ///< Nobody looks again before.
    boost::asio::steady_timer asked_;
};

} // namespace webots_cloud::app
