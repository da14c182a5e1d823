#include "unit_test.hpp"

#include "core/load/load_table.hpp"
#include "core/pages/monitor_page.hpp"

#include <regex>

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol sections 2.3, 2.4, 4.4, 9.3 and quirk Q24.
BOOST_AUTO_TEST_SUITE(monitor_page)

namespace {

/// Of servers that answer with these loads, one that does not, and one that was not asked yet.
LoadTotals totals(std::vector<std::string> const& up)
{
    LoadTable table;
    for (auto const* const address : {"down", "unknown"})
        table.put(address);
    for (auto const& load : up)
        table.put(load);
    table.record("down", LoadReport(90), 95, TimePoint());
    table.record("down", Failure(errc::unreachable), 95, TimePoint());
    for (auto const& load : up)
        table.record(load, parse_load_report(load), 95, TimePoint());
    return table.totals();
}

SessionRow row(std::string address, std::optional<double> load)
{
    SessionRow row;
    row.address = std::move(address);
    row.load = load;
    return row;
}

bool contains(std::string const& page, std::string_view text)
{
    return page.find(text) != std::string::npos;
}

} // namespace

BOOST_AUTO_TEST_CASE(the_mean_load_is_over_servers_that_are_up)
{
    BOOST_TEST(mean_load(totals({"10", "5.75"})) == "7.875");
    BOOST_TEST(mean_load(totals({})) == "-1");
    BOOST_TEST(mean_load(totals({"0"})) == "0.0");
}

BOOST_AUTO_TEST_CASE(the_table_has_links_loads_and_an_average_with_one_percent_sign)
{
    SessionMonitorView view;
    view.ssl = false;
    view.servers = {row("a:2000", 7.875), row("b/2000", {})};
    view.servers[0].sessions = 3;
    view.servers[0].placed = 12;
    view.servers[1].refusal = "Error: <No> disk";
    auto const page = session_monitor_page(view);
    BOOST_TEST(contains(page, "<title>Webots session server</title>"));
    BOOST_TEST(contains(page, "<h1>Webots session server</h1>"));
    BOOST_TEST(contains(page, "Managing 2 simulation servers:"));
    auto const started = page.find("Started on ");
    BOOST_TEST_REQUIRE(started != std::string::npos);
    std::regex const moment("Started on [A-Z][a-z]+day, [A-Z][a-z]+ \\d\\d, \\d{4} at \\d\\d:\\d\\d:\\d\\d");
    BOOST_TEST(std::regex_search(page, moment), page.substr(started, 60));
    BOOST_TEST(contains(page, "<a href=\"http://a:2000/monitor\">a:2000</a>"));
    BOOST_TEST(contains(page, "N/A"));
    BOOST_TEST(contains(page, "<b id=\"average\">7.88%</b>"));
    BOOST_TEST(contains(page, "data-label=\"sessions\">3</td>"));
    BOOST_TEST(contains(page, "data-label=\"placed\">12</td>"));
    BOOST_TEST(
        contains(page, "<span class=\"refusal\">refused its last start: Error: &lt;No&gt; disk</span>"));
    BOOST_TEST(contains(page, "<span class=\"refusal\" hidden></span>"));
    BOOST_TEST(!contains(page, "%%"));
}

BOOST_AUTO_TEST_CASE(the_page_of_a_machine_behind_the_gateway_is_below_ours)
{
    SessionMonitorView view;
    view.gateway = true;
    view.servers = {row("*/2000", 1), row("b:3000", 1)};
    auto const page = session_monitor_page(view);
    BOOST_TEST(contains(page, "data-gateway"));
    BOOST_TEST(contains(page, "<a href=\"2000/monitor\">*/2000</a>"));
    view.servers = {row("10.0.0.2:2000", 1)};
    view.servers.front().path = "/machine/abc";
    BOOST_TEST(contains(session_monitor_page(view), "<a href=\"machine/abc/monitor\">10.0.0.2:2000</a>"));
    view.servers = {row("*/2000", 1), row("b:3000", 1)};
    BOOST_TEST(contains(page, "<a href=\"https://b:3000/monitor\">b:3000</a>"));
    view.gateway = false;
    view.servers = {row("h/2000", 1)};
    BOOST_TEST(contains(session_monitor_page(view), "<a href=\"https://h/2000/monitor\">h/2000</a>"));
    BOOST_TEST(!contains(session_monitor_page(view), "data-gateway"));
}

BOOST_AUTO_TEST_CASE(of_thousands_of_servers_the_page_has_some_and_says_how_many_more_there_are)
{
    SessionMonitorView view;
    for (int i = 0; i < 5000; ++i)
        view.servers.emplace_back().address = "m" + std::to_string(i) + ":2000";
    auto const page = session_monitor_page(view);
    BOOST_TEST(contains(page, "Managing 5000 simulation servers:"));
    BOOST_TEST(contains(page, ">m199:2000<"));
    BOOST_TEST(!contains(page, ">m200:2000<"));
    BOOST_TEST(contains(page, "and 4800 more, which are shown where scripts are allowed"));
    view.servers.resize(200);
    BOOST_TEST(!contains(session_monitor_page(view), " more, "));
}

BOOST_AUTO_TEST_CASE(who_waits_is_shown_where_the_server_relays)
{
    SessionMonitorView view;
    BOOST_TEST(contains(session_monitor_page(view), "<p id=\"waiting\" hidden></p>"));
    WaitingFigures figures;
    figures.relayed = 40;
    view.waiting = figures;
    BOOST_TEST(contains(session_monitor_page(view), "<p id=\"waiting\">Waiting: 0, relayed: 40</p>"));
    view.waiting->waiting = 12;
    view.waiting->longest = std::chrono::minutes(2);
    BOOST_TEST(contains(session_monitor_page(view),
                        "<p id=\"waiting\">Waiting: 12 (longest 2 min), relayed: 40</p>"));
}

BOOST_AUTO_TEST_CASE(a_full_server_is_marked)
{
    SessionMonitorView view;
    view.servers = {row("a:2000", 95), row("b:2000", 94.9)};
    BOOST_TEST(
        contains(session_monitor_page(view), "<td class=\"number full\" data-label=\"load\">95.0%</td>"));
    BOOST_TEST(contains(session_monitor_page(view), ">94.9%</td>"));
}

// Issue 42, item 3: "servers full 0" at 4 of 4 seats.
BOOST_AUTO_TEST_CASE(seats_are_shown_and_what_a_server_and_the_site_are)
{
    SessionMonitorView view;
    view.state = SiteState::full;
    view.servers = {row("a:2000", 20)};
    view.servers.front().sessions = view.servers.front().seats = 4;
    view.servers.front().state = SiteState::full;
    auto const page = session_monitor_page(view);
    BOOST_TEST(contains(page, "<p id=\"site\">Every seat is taken.</p>"));
    BOOST_TEST(contains(page, "<td class=\"number full\" data-label=\"sessions\">4 of 4</td>"));
    BOOST_TEST(contains(page, "<td data-label=\"state\">full</td>"));
}

BOOST_AUTO_TEST_CASE(each_page_has_a_row_for_its_script_to_copy)
{
    auto const session = session_monitor_page(SessionMonitorView());
    BOOST_TEST(contains(session, "<template id=\"row\"><tr class=\"down\"><td class=\"number\">0</td>"));
    BOOST_TEST(contains(session, "<a href=\"https://{address}/monitor\">{address}</a>"));
    auto const simulation = simulation_monitor_page(SimulationMonitorView());
    BOOST_TEST(contains(simulation, "<template id=\"row\"><tr><td class=\"number\">0</td>"));
}

BOOST_AUTO_TEST_CASE(every_value_is_escaped)
{
    SessionMonitorView view;
    auto hostile = row("<script>:1", {});
    hostile.problem = "<img src=x>";
    view.servers = {hostile};
    BOOST_TEST(!contains(session_monitor_page(view), "<script>"));
    BOOST_TEST(!contains(session_monitor_page(view), "<img"));

    SimulationMonitorView simulation;
    simulation.title = simulation.description = simulation.notice = simulation.warning =
        simulation.limits_warning = "<script>";
    simulation.allowed = simulation.blocked = {"https://x/\"><script>"};
    SimulationRow hostile_row;
    hostile_row.world = hostile_row.state = hostile_row.log = "<script>";
    simulation.simulations = {hostile_row};
    simulation.notify = {"https://<script>/x", "<script>"};
    simulation.host.system = simulation.host.name = simulation.host.processor = simulation.host.gpu =
        "<script>";
    BOOST_TEST(!contains(simulation_monitor_page(simulation), "<script>"));
}

BOOST_AUTO_TEST_CASE(the_simulation_page_has_every_figure_of_the_reference)
{
    SimulationMonitorView view;
    view.title = "Lab 7";
    view.description = "Ask Ada.";
    view.limits_warning = "Some limits are not kept.";
    view.load = 12.345;
    view.host.system = "Debian GNU/Linux 12";
    view.host.name = "lab7";
    view.host.processor = "Fast One";
    view.host.cores = 16;
    view.host.threads_per_core = 2;
    view.host.memory_bytes = std::uint64_t{32} << 30;
    view.sample.cpu = 25;
    view.sample.memory = 50;
    view.allowed = {"https://github.com/cyberbotics", "local:/demo"};
    view.notify = {"https://webots.cloud/ajax/server/setup.php"};
    auto const page = simulation_monitor_page(view);
    for (auto const* text : {"<title>Webots simulation server</title>", "<h1>Lab 7</h1>", "<p>Ask Ada.</p>",
                             "<p class=\"notice\">Some limits are not kept.</p>", "Current load: ",
                             ">12.35%</b>", "Debian GNU/Linux 12 (lab7)", ">25.0%</b> Fast One (2x 8 cores)",
                             "Not recognized", ">50.0%</b> of 32.0GB, swap ", "Allowed Repositories",
                             "<a href=\"https://github.com/cyberbotics\">", "<td>local:/demo</td>",
                             "Share Idle Time: <b>50.0%</b>", "<a href=\"https://webots.cloud\">"})
        BOOST_TEST(contains(page, text), text);
    BOOST_TEST(!contains(page, "Blocked Repositories"));
    view.title.clear();
    view.blocked = {"https://github.com/evil"};
    auto const other = simulation_monitor_page(view);
    BOOST_TEST(contains(other, "<h1>Webots simulation server</h1>"));
    BOOST_TEST(contains(other, "Blocked Repositories"));
    BOOST_TEST(contains(other, "<a href=\"https://github.com/evil\">"));
}

BOOST_AUTO_TEST_CASE(graphics_processors_are_shown_with_their_load_and_memory)
{
    SimulationMonitorView view;
    view.host.gpu = "2x NVIDIA T4 (15.8GB)";
    view.sample.gpu_compute = 35;
    view.sample.gpu_memory = 75;
    auto const page = simulation_monitor_page(view);
    for (auto const* text :
         {"GPU load compute", ">35.0%</b> 2x NVIDIA T4 (15.8GB)", "GPU RAM usage", ">75.0%</b>"})
        BOOST_TEST(contains(page, text), text);
    BOOST_TEST(!contains(page, "Not recognized"));
}

BOOST_AUTO_TEST_CASE(percentages_say_what_they_are_coloured_by)
{
    SimulationMonitorView view;
    view.sample.cpu = 100;
    auto const page = simulation_monitor_page(view);
    BOOST_TEST(contains(page, "id=\"cpu\" style=\"--value:100.0\">100.0%"));
    BOOST_TEST(contains(page, "id=\"load\" style=\"--value:0.0\">0.0%"));
}

BOOST_AUTO_TEST_CASE(styles_and_scripts_stand_in_the_page_itself)
{
    SessionMonitorView view;
    view.assets.styles = {"b{}"};
    view.assets.scripts = {"one();", "two();"};
    view.assets.port = 1999;
    auto const page = session_monitor_page(view);
    BOOST_TEST(contains(page, "<style>\nb{}</style>"));
    BOOST_TEST(page.find("one();") < page.find("two();"));
    BOOST_TEST(contains(page, "data-port=\"1999\""));
    BOOST_TEST(!contains(page, "src="));
}

BOOST_AUTO_TEST_SUITE_END()
