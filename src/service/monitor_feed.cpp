#include "monitor_feed.hpp"

#include "core/text.hpp"
#include "web/assets.hpp"

namespace webots_cloud {
namespace {

web::Asset find(std::string_view path)
{
    return web::find_asset(path).value_or(web::Asset());
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
    for (;;) { // ignores what the browser sends, and waits until it leaves
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
    for (auto const* style :
         {"monitor/dygraph.min.css", "view/tokens.css", "viewer/base.css", "monitor/monitor.css"})
        assets.styles.push_back(find(style).content);
    for (auto const name : {std::string_view("dygraph.min.js"), std::string_view("live.js"),
                            std::string_view("operator.js"), script}) {
        auto const asset = find(core::concat("monitor/", name));
        assets.scripts.push_back(asset.content);
        assets.script_hashes.push_back(asset.inline_hash);
    }
    return assets;
}

} // namespace webots_cloud
