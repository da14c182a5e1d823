// The key `challengeFolder`: what certificate authorities ask for is answered at every port of a server,
// since some are led to https first.
#pragma once

#include "endpoint_in_front.hpp"

#include <filesystem>
#include <utility>

namespace webots_cloud::app {

/// Answers challenges (RFC 8555, section 8.3); everything else is for the endpoint behind.
class Challenges final : public EndpointInFront
{
public:
    /// Without a `folder` there are none.
    Challenges(std::filesystem::path folder, Endpoint& behind)
        : EndpointInFront(behind), folder_(std::move(folder))
    {}

    Answer respond(IncomingRequest const& request) override;

private:
    std::filesystem::path folder_;
};

} // namespace webots_cloud::app
