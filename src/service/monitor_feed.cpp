#include "monitor_feed.hpp"

#include "../core/text.hpp"
#include "../web/assets.hpp"

namespace webots_cloud {
namespace {

std::string_view content(std::string_view name)
{
    auto const asset = web::find_asset(core::concat("monitor/", name));
    return asset ? asset->content : std::string_view();
}

} // namespace

void MonitorFeed::publish(std::string const& text)
{
    for (auto* const watcher : watchers_)
        (void)watcher->send(text);
}

boost::asio::awaitable<void> MonitorFeed::serve(std::string greeting, Channel& channel)
{
    watchers_.insert(&channel);
    (void)channel.send(std::move(greeting));
    for (;;) { // what a browser says is of no interest, but that it leaves is
        auto const said = co_await channel.receive();
        if (!said)
            break;
    }
    watchers_.erase(&channel);
}

core::PageAssets monitor_assets(std::string_view script, std::uint16_t port)
{
    core::PageAssets assets;
    assets.port = port;
    assets.styles = {content("dygraph.min.css"), content("monitor.css")};
    assets.scripts = {content("dygraph.min.js"), content("live.js"), content(script)};
    return assets;
}

} // namespace webots_cloud
