// The browsers that watch a monitor page.
#pragma once

#include "core/pages/page_parts.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>
#include <unordered_set>

namespace webots_cloud {

/// Sends each text to all browsers that watch. A browser that does not read is dropped by its channel, and
/// delays no other.
class MonitorFeed
{
public:
    bool empty() const noexcept { return watchers_.empty(); }

    void publish(std::string const& text);

    /// Sends a browser `greeting`, and then each published text until it leaves.
    /// Lifetime: the feed must outlive that.
    boost::asio::awaitable<void> serve(std::string greeting, Channel& channel);

private:
    std::unordered_set<Channel*> watchers_;
};

/// The styles and scripts of a monitor page; `script` is the file in `src/web/monitor` that belongs to the
/// page.
core::PageAssets monitor_assets(std::string_view script, std::uint16_t port);

} // namespace webots_cloud
