// Tells a browser on /client why something is refused, or has ended.
#pragma once

#include "core/refusals.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/transport/endpoint.hpp>

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

} // namespace webots_cloud
