// Tells a browser on /client why something is refused, or has ended, and a request that it must be a
// WebSocket.
#pragma once

#include "core/pages/http_pages.hpp"
#include "core/refusals.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/simulation/gateway_address.hpp"
#include "core/text.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud {

/// With its code before the sentence, where the page wants that and the failure has one.
inline void tell(Channel& channel, Failure const& why, bool with_reason)
{
    if (auto reason = core::reason_message(why); with_reason && !reason.empty())
        (void)channel.send(std::move(reason));
    (void)channel.send(core::error_message(why.message()));
}

inline void tell_wrong_message(Channel& channel, std::string_view words, bool with_reason)
{
    tell(channel, core::refused(core::Refused::wrong_message, {{"words", words}}), with_reason);
}

/// The answer to a request on /client that is no WebSocket. Proxies without rules for WebSockets leave out
/// `Upgrade` alone, which is for one connection: then the log names the proxy as the reason.
inline HttpResponse upgrade_wanted(Logger const& log, IncomingRequest const& request)
{
    constexpr std::size_t max_shown = 200;
    if (!request.header("Sec-WebSocket-Key").empty())
        log.warning(LogCause("upgrade", request.client),
                    core::concat(
                        "A WebSocket for ", core::printable(core::without_keys(request.path), max_shown),
                        " came without \"Upgrade\"", core::of_client(request.client),
                        ": a proxy in between lacks the rules that pass WebSockets on, see docs/gateway.md"));
    return HttpResponse(400, std::string(core::html_type), "Can \"Upgrade\" only to \"WebSocket\".");
}

} // namespace webots_cloud
