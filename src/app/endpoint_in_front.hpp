// What stands in front of a service passes on all that it does not answer itself: the one list of what that
// is.
#pragma once

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <utility>

namespace webots_cloud::app {

/// Passes everything on; those derived from it answer some requests themselves.
///
/// Lifetime: `behind` must outlive it.   Thread-safety: as that of `behind`.
class EndpointInFront : public Endpoint
{
public:
    Answer respond(IncomingRequest const& request) override { return behind_.respond(request); }
    std::uint64_t max_body(IncomingRequest const& request) override { return behind_.max_body(request); }
    boost::asio::awaitable<HttpResponse> respond_to_body(IncomingRequest const& request) override
    {
        return behind_.respond_to_body(request);
    }
    boost::asio::awaitable<void> serve_websocket(ChannelInfo info, Channel& channel) override
    {
        return behind_.serve_websocket(std::move(info), channel);
    }
    void stopping() override { behind_.stopping(); }
    void dress(HttpResponse& refusal, IncomingRequest const& request) override
    {
        behind_.dress(refusal, request);
    }

protected:
    explicit EndpointInFront(Endpoint& behind) : behind_(behind) {}

private:
    Endpoint& behind_;
};

} // namespace webots_cloud::app
