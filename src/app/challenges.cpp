#include "challenges.hpp"

#include "core/access/https_address.hpp"
#include "core/pages/http_pages.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <string>
#include <string_view>

namespace webots_cloud::app {
namespace {

// Bytes; what certbot writes has about a hundred.
constexpr std::size_t max_challenge = 4096;

/// A small file on this machine, now and then: reading it keeps nobody waiting.
HttpResponse answer_challenge(std::filesystem::path const& folder, std::string_view name)
{
    auto const text = read_regular_file(folder / ".well-known" / "acme-challenge" / name, max_challenge);
    return text ? HttpResponse(200, "text/plain", *text)
                : HttpResponse(404, std::string(core::html_type), "There is no such challenge.");
}

} // namespace

Answer Challenges::respond(IncomingRequest const& request)
{
    auto const challenge = core::challenge_in(request.path);
    if (challenge.empty() || folder_.empty())
        return EndpointInFront::respond(request);
    return answer_challenge(folder_, challenge);
}

} // namespace webots_cloud::app
