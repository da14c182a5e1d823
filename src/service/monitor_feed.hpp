// The browsers that watch a monitor page.
#pragma once

#include "core/pages/page_parts.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>
#include <unordered_set>

namespace webots_cloud {

/// Passes each text to all who watch. A browser that does not read is dropped by its channel and slows
/// nobody.
class MonitorFeed
{
public:
    bool empty() const noexcept { return watchers_.empty(); }

    void publish(std::string const& text);

    /// Greets a browser and keeps it informed until it leaves.   Lifetime: the feed must outlive the
    /// conversation.
    boost::asio::awaitable<void> serve(std::string greeting, Channel& channel);

private:
    std::unordered_set<Channel*> watchers_;
};

/// The styles and scripts of a monitor page; `script` is its own one, of `src/web/monitor`.
core::PageAssets monitor_assets(std::string_view script, std::uint16_t port);

} // namespace webots_cloud
