#include "monitor_page.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

/// Of thousands of machines they would take so long to write that others would notice; the page's script
/// lists all.
constexpr std::size_t max_rows = 200;

/// Where a machine's own page is. Behind the gateway it is below ours, whatever browsers call us.
std::string monitor_link(SessionRow const& server, SessionMonitorView const& view)
{
    std::string_view const address = server.address;
    if (!server.path.empty())
        return concat(server.path.substr(1), "/monitor");
    auto const slash = address.rfind('/');
    if (view.gateway && slash != std::string_view::npos && parse_port(address.substr(slash + 1)) != 0)
        return concat(address.substr(slash + 1), "/monitor");
    return concat(view.ssl ? "https://" : "http://", address, "/monitor");
}

/// The page's script says it in the same words.
std::string_view draining_text(std::string_view drained_by)
{
    if (drained_by == "operator")
        return "drained by the operator";
    if (drained_by == "configuration")
        return "drained by the configuration";
    return drained_by == "machine" ? "draining" : "";
}

/// The page's script says it in the same words.
std::string refusal_text(std::string_view refusal)
{
    return refusal.empty() ? std::string() : concat("refused its last start: ", refusal);
}

/// `3 of 4`; the page's script says it in the same words.
std::string sessions_text(SessionRow const& server)
{
    if (!server.sessions)
        return {};
    return concat(std::to_string(*server.sessions),
                  server.seats ? concat(" of ", std::to_string(*server.seats)) : std::string());
}

/// A row of the table. The page's script shows the column `line` and the keys of the chart, which mean
/// nothing without it.
std::string server_row(std::size_t number, SessionRow const& server, SessionMonitorView const& view)
{
    auto const address = escape_html(server.address);
    auto const link = escape_html(monitor_link(server, view));
    bool const is_crowded = server.load && *server.load >= view.threshold;
    std::string report = "waiting";
    if (server.load)
        report = age_text(view.now - server.reported);
    else if (!server.problem.empty())
        report = escape_html(server.problem);
    return concat(
        "<tr", server.load ? "" : " class=\"down\"", "><td class=\"number\">", std::to_string(number),
        "</td><td class=\"name\"><span class=\"key\" hidden></span><a href=\"", link, "\">", address,
        "</a> <span class=\"drained\"", server.drained_by.empty() ? " hidden" : "", ">",
        draining_text(server.drained_by), "</span> <span class=\"found\"",
        server.found_by.empty() ? " hidden" : "", ">", escape_html(server.found_by),
        "</span><span class=\"refusal\"", server.refusal.empty() ? " hidden" : "", ">",
        escape_html(refusal_text(server.refusal)), "</span></td><td class=\"number",
        is_crowded ? " full" : "", "\" data-label=\"load\">",
        server.load ? concat(rounded(*server.load), "%") : "N/A",
        "</td><td class=\"line\"><svg viewBox=\"0 0 600 100\" preserveAspectRatio=\"none\"><path/></svg>"
        "</td><td class=\"number",
        server.state == SiteState::full ? " full" : "", "\" data-label=\"sessions\">", sessions_text(server),
        "</td><td data-label=\"state\">", server.state ? word_of(*server.state) : std::string_view(),
        "</td><td class=\"number\" data-label=\"placed\">", std::to_string(server.placed),
        "</td><td data-label=\"last report\">", report, "</td></tr>\n");
}

/// The row that the page's script copies for each server and fills in, so that rows look the same with and
/// without it.
std::string row_template(SessionMonitorView const& view)
{
    SessionRow row;
    row.address = "{address}"; // wherever the address belongs
    return concat("<template id=\"row\">", server_row(0, row, view), "</template>\n");
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
    auto html = page_begin("session", "Webots session server", view.assets);
    html += concat(
        "<p>Started on ", long_local_time(view.started), "</p>\n<p id=\"site\">", sentence_of(view.state),
        "</p>\n<p id=\"waiting\"", view.waiting ? concat(">", waiting_text(*view.waiting)) : " hidden>",
        "</p>\n<section id=\"charts\" hidden></section>\n<section>\n<p id=\"managing\">Managing ",
        std::to_string(count), count > 1 ? " simulation servers:" : " simulation server:",
        "</p>\n<div class=\"scroll\"><table class=\"bordered\" id=\"servers\"",
        view.gateway ? " data-gateway" : "",
        ">\n<thead><tr><th>#</th>"
        "<th>simulation server</th><th>load</th><th class=\"line\">last 10 minutes</th>"
        "<th>sessions</th><th>state</th><th>placed here</th><th>last report</th></tr></thead>\n<tbody>\n");
    auto const shown = std::min(count, max_rows);
    for (std::size_t i = 0; i < shown; ++i)
        html += server_row(i + 1, view.servers[i], view);
    if (shown < count)
        html += concat("<tr><td></td><td colspan=\"7\">and ", std::to_string(count - shown),
                       " more, which are shown where scripts are allowed</td></tr>\n");
    html += concat(
        "</tbody>\n<tfoot><tr><td></td><td><b>average:</b></td><td class=\"number\"><b id=\"average\">",
        average(view.servers),
        "</b></td><td "
        "class=\"line\"></td><td></td><td></td><td></td><td></td></tr></tfoot>\n</table></div>\n",
        row_template(view), "</section>\n<p><a href=\"viewer/\">Start a simulation</a></p>\n");
    return html + page_end(view.assets);
}

} // namespace webots_cloud::core
