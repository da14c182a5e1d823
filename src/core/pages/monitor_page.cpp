// The page is a shell with the first figures as JSON, which scripts in src/web/monitor draw and keep up to
// date: no row is made twice, here and there.
#include "monitor_page.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <webots_cloud/version.hpp>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/serialize.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

namespace json = boost::json;

/// JSON in a page: no string of it may end the element.
std::string for_page(std::string_view text)
{
    std::string safe;
    for (auto bracket = text.find('<'); bracket != std::string_view::npos; bracket = text.find('<')) {
        safe.append(text.substr(0, bracket)).append("\\u003c");
        text.remove_prefix(bracket + 1);
    }
    return safe.append(text);
}

std::string data_block(std::string_view id, std::string_view content)
{
    return concat("<script type=\"application/json\" id=\"", id, "\">", for_page(content), "</script>\n");
}

json::array list(std::vector<std::string> const& texts)
{
    json::array all;
    for (auto const& text : texts)
        if (!text.empty())
            all.emplace_back(text);
    return all;
}

/// Registries by the page that people know: the host, not the script that takes our registration.
std::string host_of(std::string const& url)
{
    auto const host = url.find("://");
    auto const end = host == std::string::npos ? std::string::npos : url.find('/', host + 3);
    return url.substr(0, end);
}

json::object host_json(HostDescription const& host)
{
    json::object object;
    object["system"] = host.system;
    object["name"] = host.name;
    object["processor"] = host.processor;
    object["threads"] = host.cores;
    object["cores"] = host.cores / std::max(1, host.threads_per_core);
    object["memory"] = host.memory_bytes;
    if (!host.gpu.empty())
        object["gpu"] = host.gpu;
    return object;
}

} // namespace

std::string monitor_page(MonitorPage const& page)
{
    auto html = page_begin(page.title, page.heading.empty() ? page.title : page.heading, page.assets);
    html += concat("<noscript><p class=\"banner\">", page.words,
                   "</p><p>This page needs JavaScript to show more. Programs get all of it as JSON, with the "
                   "header <code>Accept: application/json</code>.</p></noscript>\n");
    return html + page_end(page.assets,
                           data_block("texts", page.assets.texts) + data_block("snapshot", page.snapshot));
}

std::string monitor_texts(std::string_view own, std::vector<LanguageTexts> const& others)
{
    auto const read = [](std::string_view text) {
        boost::system::error_code failed;
        auto value = json::parse(text, failed);
        return value.is_object() ? value.get_object() : json::object();
    };
    auto const table = read(own);
    json::object all;
    for (auto const& [language, texts] : others) {
        json::object said;
        for (auto const& [key, languages] : table)
            if (auto const* text = languages.get_object().if_contains(language))
                said[key] = *text;
        auto const shared = read(texts);
        for (auto const& [key, text] : shared)
            if (key.starts_with("site.") || key == "waiting.room" || key == "waiting.suitable")
                said[key] = text;
        all[language] = std::move(said);
    }
    return json::serialize(all);
}

std::string mean_load(LoadTotals const& totals)
{
    return totals.up == 0 ? "-1" : python_float(totals.load / static_cast<double>(totals.up));
}

std::string session_words(WallTime started, std::size_t machines, LoadTotals const& totals)
{
    auto const average =
        totals.up == 0 ? "N/A" : concat(rounded(totals.load / static_cast<double>(totals.up)), "%");
    return concat("Started on ", long_local_time(started), ". Managing ", std::to_string(machines),
                  machines > 1 ? " simulation servers: " : " simulation server: ", "average: ", average, ".");
}

std::string simulation_words(double load)
{
    return concat("Current load: ", rounded(load), "%.");
}

std::string about_json(SessionAbout const& about)
{
    json::object object;
    object["started"] =
        std::chrono::duration_cast<std::chrono::seconds>(about.started.time_since_epoch()).count();
    object["version"] = version();
    object["tls"] = about.is_tls;
    object["gateway"] = about.is_gateway;
    object["decisions"] = about.shows_decisions;
    return json::serialize(object);
}

std::string about_json(SimulationAbout const& about)
{
    std::vector<std::string> hosts(about.registries.size());
    std::ranges::transform(about.registries, hosts.begin(), host_of);
    json::object object;
    object["version"] = version();
    object["title"] = about.title;
    object["description"] = about.description;
    object["notices"] = list(about.notices);
    object["sandbox"] = about.sandbox;
    object["display"] = about.display;
    object["host"] = host_json(about.host);
    object["allowed"] = list(about.allowed);
    object["blocked"] = list(about.blocked);
    object["registries"] = list(hosts);
    object["shareIdleTime"] = about.share_idle_time;
    return json::serialize(object);
}

} // namespace webots_cloud::core
