#include "monitor_feed.hpp"

#include "core/pages/monitor_page.hpp"
#include "core/text.hpp"
#include "web/assets.hpp"

#include <vector>

namespace webots_cloud {
namespace {

web::Asset find(std::string_view path)
{
    return web::find_asset(path).value_or(web::Asset());
}

std::string texts_of_all_languages()
{
    std::vector<core::LanguageTexts> others;
    for (std::string_view const language : {"en", "de", "es", "fr", "it", "ja", "zh"})
        others.push_back({language, find(core::concat("view/texts/", language, ".json")).content});
    return core::monitor_texts(find("monitor/texts.json").content, others);
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
    static std::string const texts = texts_of_all_languages();
    core::PageAssets assets;
    assets.port = port;
    assets.texts = texts;
    assets.logo = find("viewer/favicon.svg").content;
    for (auto const* style : {"view/tokens.css", "viewer/base.css", "viewer/page.css", "monitor/monitor.css"})
        assets.styles.push_back(find(style).content);
    for (auto const name : {std::string_view("texts.js"), std::string_view("chart.js"),
                            std::string_view("live.js"), std::string_view("operator.js"), script}) {
        auto const asset = find(core::concat("monitor/", name));
        assets.scripts.push_back(asset.content);
        assets.script_hashes.push_back(asset.inline_hash);
    }
    return assets;
}

} // namespace webots_cloud
