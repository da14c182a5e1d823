// The HTML of the simulation server's monitor page as it is first sent; scripts in src/web/monitor keep it up
// to date. All text from elsewhere is escaped where it is put in.
#include "monitor_page.hpp"

#include "core/text.hpp"
#include "core/time_text.hpp"

#include <algorithm>
#include <cmath>

namespace webots_cloud::core {
namespace {

/// A percentage, which the style colours from green to red.
std::string percentage(std::string_view id, double value)
{
    auto const text = rounded(value);
    return concat("<b class=\"percent\" id=\"", id, "\" style=\"--value:", text, "\">", text, "%</b>");
}

/// A line of the table; `html` is escaped already.
std::string definition(std::string_view term, std::string_view html)
{
    return concat("<tr><th scope=\"row\">", term, "</th><td>", html, "</td></tr>\n");
}

std::string cores_text(HostDescription const& host)
{
    int const threads = std::max(1, host.threads_per_core);
    return concat("(", std::to_string(threads), "x ", std::to_string(host.cores / threads), " cores)");
}

std::string machine(SimulationMonitorView const& view)
{
    auto const& host = view.host;
    auto html = concat("<table class=\"bordered\" id=\"machine\">\n",
                       definition("Host", escape_html(concat(host.system, " (", host.name, ")"))),
                       definition("CPU load", concat(percentage("cpu", view.sample.cpu), " ",
                                                     escape_html(host.processor), " ", cores_text(host))));
    if (host.gpu.empty())
        html += definition("GPU", "Not recognized");
    else
        html +=
            concat(definition("GPU load compute", concat(percentage("gpu-compute", view.sample.gpu_compute),
                                                         " ", escape_html(host.gpu))),
                   definition("GPU RAM usage", percentage("gpu-memory", view.sample.gpu_memory)));
    html += definition("RAM",
                       concat(percentage("memory", view.sample.memory), " of ", gigabytes(host.memory_bytes),
                              ", swap ", percentage("swap", view.sample.swap)));
    return html + "</table>\n";
}

std::string links(std::vector<std::string> const& urls, std::string_view separator)
{
    std::string html;
    for (auto const& url : urls) {
        auto const text = escape_html(url);
        bool const is_link = url.starts_with("https://") || url.starts_with("http://");
        html += concat(html.empty() ? "" : separator,
                       is_link ? concat("<a href=\"", text, "\">", text, "</a>") : text);
    }
    return html;
}

std::string repositories(std::string_view heading, std::vector<std::string> const& urls)
{
    if (urls.empty())
        return {};
    return concat("<table class=\"bordered\">\n<thead><tr><th>", heading,
                  "</th></tr></thead>\n<tbody>\n<tr><td>", links(urls, "</td></tr>\n<tr><td>"),
                  "</td></tr>\n</tbody>\n</table>\n");
}

/// Registries by the page that people know: the host, not the script that takes our registration.
std::string sharing(SimulationMonitorView const& view)
{
    std::vector<std::string> hosts;
    for (auto const& url : view.notify) {
        auto const host = url.find("://");
        auto const end = host == std::string::npos ? std::string::npos : url.find('/', host + 3);
        hosts.push_back(url.substr(0, end));
    }
    auto const registries = links(hosts, ", ");
    return concat("<p>Share Idle Time: <b>", rounded(view.share_idle_time), "%</b>",
                  registries.empty() ? "" : concat(" on ", registries), "</p>\n");
}

std::string figure(std::optional<double> value, std::string_view unit, bool more)
{
    return value ? concat(more ? "more than " : "", python_float(std::round(*value * 10) / 10), unit)
                 : std::string();
}

/// A row of the table. The page's script copies an empty one for each simulation that begins.
std::string simulation_row(SimulationRow const& row)
{
    auto const world = escape_html(row.world);
    return concat("<tr><td class=\"number\">", std::to_string(row.id), "</td><td class=\"world\" title=\"",
                  world, "\">", world, "</td><td data-label=\"state\">", escape_html(row.state),
                  "</td><td class=\"number\" data-label=\"age\">", age_text(row.age),
                  "</td><td class=\"number\" data-label=\"CPU\">", figure(row.cpu, "%", row.more),
                  row.graphics > 0 ? concat(", GPU ", figure(row.graphics, "%", false)) : "",
                  "</td><td class=\"number\" data-label=\"memory\">", figure(row.memory, " MB", row.more),
                  "</td><td class=\"number\" data-label=\"processes\">",
                  row.processes ? concat(row.more ? "more than " : "", std::to_string(*row.processes)) : "",
                  "</td><td class=\"number\" data-label=\"process\">",
                  row.process == 0 ? "" : std::to_string(row.process), "</td><td data-label=\"log\">",
                  escape_html(row.log), "</td></tr>\n");
}

std::string simulations(SimulationMonitorView const& view)
{
    auto const ready = staged(view.simulations);
    auto html =
        concat("<section>\n<h2>Simulations: <span id=\"count\">", std::to_string(view.simulations.size()),
               "</span> of at most ", std::to_string(view.capacity), "<span id=\"staged\">",
               ready == 0 ? "" : concat(", ", std::to_string(ready), " of them staged"),
               "</span></h2>\n<div class=\"scroll\"><table class=\"bordered\" id=\"simulations\"",
               view.simulations.empty() ? " hidden" : "",
               ">\n<thead><tr><th>#</th><th>world</th><th>state</th><th>age</th><th>CPU</th><th>memory</th>"
               "<th>processes</th><th>process</th><th>log</th></tr></thead>\n<tbody>\n");
    for (auto const& row : view.simulations)
        html += simulation_row(row);
    return html + concat("</tbody>\n</table></div>\n<template id=\"row\">", simulation_row(SimulationRow()),
                         "</template>\n</section>\n");
}

} // namespace

std::string simulation_monitor_page(SimulationMonitorView const& view)
{
    auto html =
        page_begin("simulation", view.title.empty() ? "Webots simulation server" : view.title, view.assets);
    for (auto const* notice : {&view.notice, &view.warning, &view.limits_warning})
        if (!notice->empty())
            html += concat("<p class=\"notice\">", escape_html(*notice), "</p>\n");
    if (!view.description.empty())
        html += concat("<p>", escape_html(view.description), "</p>\n");
    html += concat("<p class=\"notice\" id=\"draining\"", view.draining ? "" : " hidden",
                   ">This machine drains: it takes no new simulations.</p>\n");
    html += concat("<p>Current load: ", percentage("load", view.load), "</p>\n");
    if (!view.sandbox.empty())
        html += concat("<p>Sandbox of simulations: <span id=\"sandbox\">", escape_html(view.sandbox),
                       "</span></p>\n");
    if (!view.display.empty())
        html += concat("<p>Display of simulations: <span id=\"display\">", escape_html(view.display),
                       "</span></p>\n");
    html += machine(view);
    html += "<section id=\"charts\" hidden></section>\n";
    html += simulations(view);
    html += concat("<section>\n", repositories("Allowed Repositories", view.allowed),
                   repositories("Blocked Repositories", view.blocked), sharing(view), "</section>\n");
    return html + page_end(view.assets);
}

} // namespace webots_cloud::core
