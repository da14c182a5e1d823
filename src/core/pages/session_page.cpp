#include "monitor_page.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

namespace webots_cloud::core {
namespace {

std::string load_text(double load, double threshold)
{
    auto const text = concat(rounded(load), "%");
    return load >= threshold ? concat("<span class=\"full\">", text, "</span>") : text;
}

std::string server_row(std::size_t number, SessionRow const& server, SessionMonitorView const& view)
{
    auto const address = escape_html(server.address);
    auto const link =
        concat("<a href=\"", view.ssl ? "https://" : "http://", address, "/monitor\">", address, "</a>");
    std::string report = "waiting";
    if (server.load)
        report = age_text(view.now - server.reported);
    else if (!server.problem.empty())
        report = escape_html(server.problem);
    return concat("<tr><td class=\"number\">", std::to_string(number), "</td><td>", link,
                  "</td><td class=\"number\" data-label=\"load\">",
                  server.load ? load_text(*server.load, view.threshold) : "N/A",
                  "</td><td class=\"number\" data-label=\"sessions\">",
                  server.sessions ? std::to_string(*server.sessions) : std::string(),
                  "</td><td class=\"number\" data-label=\"placed\">", std::to_string(server.placed),
                  "</td><td data-label=\"last report\">", report, "</td></tr>\n");
}

std::string average(std::vector<SessionRow> const& servers)
{
    double sum = 0;
    int up = 0;
    for (auto const& server : servers) {
        sum += server.load.value_or(0);
        up += server.load ? 1 : 0;
    }
    return up == 0 ? "N/A" : concat(rounded(sum / up), "%");
}

} // namespace

std::string mean_load(LoadTotals const& totals)
{
    return totals.up == 0 ? "-1" : python_float(totals.load / static_cast<double>(totals.up));
}

std::string session_monitor_page(SessionMonitorView const& view)
{
    auto const count = view.servers.size();
    auto html = page_begin("session", "Webots session server", view.assets,
                           concat("data-scheme=\"", view.ssl ? "https" : "http", "\""));
    html += concat(
        "<p>Started on ", long_local_time(view.started),
        "</p>\n<section id=\"charts\" hidden></section>\n<section>\n<p id=\"managing\">Managing ",
        std::to_string(count), count > 1 ? " simulation servers:" : " simulation server:",
        "</p>\n<div class=\"scroll\"><table class=\"bordered\" id=\"servers\">\n<thead><tr><th>#</th>"
        "<th>simulation server</th><th>load</th><th>sessions</th><th>placed here</th><th>last report</th>"
        "</tr></thead>\n<tbody>\n");
    std::size_t number = 0;
    for (auto const& server : view.servers)
        html += server_row(++number, server, view);
    html += concat(
        "</tbody>\n<tfoot><tr><td></td><td><b>average:</b></td><td class=\"number\"><b id=\"average\">",
        average(view.servers),
        "</b></td><td></td><td></td><td></td></tr></tfoot>\n</table></div>\n</section>\n"
        "<p><a href=\"viewer/\">Start a simulation</a></p>\n");
    return html + page_end(view.assets);
}

} // namespace webots_cloud::core
