// The key `challengeFolder`: what certificate authorities ask for is answered at every port of a server,
// since some are led to https first.
#pragma once

#include <webots_cloud/transport/endpoint.hpp>

#include <filesystem>

namespace webots_cloud::app {

/// Answers challenges (RFC 8555, section 8.3); everything else is for the endpoint behind.
///
/// Lifetime: `behind` must outlive it.
class Challenges final : public Endpoint
{
public:
    /// Without a `folder` there are none.
    Challenges(std::filesystem::path folder, Endpoint& behind) : folder_(std::move(folder)), behind_(behind)
    {}

    Answer respond(IncomingRequest const& request) override;
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

private:
    std::filesystem::path folder_;
    Endpoint& behind_;
};

} // namespace webots_cloud::app
