#include "unit_test.hpp"

#include "core/load/load_table.hpp"
#include "core/pages/monitor_page.hpp"

#include <regex>

using namespace webots_cloud;
using namespace webots_cloud::core;

// Protocol sections 2.3, 2.4, 4.4, 9.3 and quirk Q24.
BOOST_AUTO_TEST_SUITE(monitor_pages)

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

// Programs may look for them (protocol 2.4 and 9.3).
BOOST_AUTO_TEST_CASE(the_words_of_old_pages_are_there_for_who_has_no_scripts)
{
    MonitorPage page;
    page.title = "Webots session server";
    page.words = session_words(WallTime(std::chrono::seconds(1'700'000'000)), 2, totals({"7.875"}));
    auto const html = monitor_page(page);
    BOOST_TEST(contains(html, "<title>Webots session server</title>"));
    BOOST_TEST(contains(html, "<h1>Webots session server</h1>"));
    BOOST_TEST(contains(html, "<noscript>"));
    BOOST_TEST(contains(html, "Managing 2 simulation servers:"));
    BOOST_TEST(contains(html, "average: 7.88%."));
    std::regex const moment("Started on [A-Z][a-z]+day, [A-Z][a-z]+ \\d\\d, \\d{4} at \\d\\d:\\d\\d:\\d\\d");
    BOOST_TEST(std::regex_search(html, moment), html);
    BOOST_TEST(
        contains(session_words(WallTime(), 1, totals({})), "Managing 1 simulation server: average: N/A."));
    BOOST_TEST(simulation_words(12.345) == "Current load: 12.35%.");
}

BOOST_AUTO_TEST_CASE(the_heading_is_the_title_of_the_machine)
{
    MonitorPage page;
    page.title = "Webots simulation server";
    page.heading = "Lab <7>";
    BOOST_TEST(contains(monitor_page(page), "<title>Webots simulation server</title>"));
    BOOST_TEST(contains(monitor_page(page), "<h1>Lab &lt;7&gt;</h1>"));
    page.heading.clear();
    BOOST_TEST(contains(monitor_page(page), "<h1>Webots simulation server</h1>"));
}

BOOST_AUTO_TEST_CASE(no_text_of_a_snapshot_ends_its_element)
{
    MonitorPage page;
    page.snapshot = R"({"world":"</script><script>alert(1)</script><!--"})";
    auto const html = monitor_page(page);
    BOOST_TEST(contains(
        html,
        R"json(id="snapshot">{"world":"\u003c/script>\u003cscript>alert(1)\u003c/script>\u003c!--"}</script>)json"));
}

BOOST_AUTO_TEST_CASE(of_other_pages_the_monitors_say_what_a_site_is_and_why_people_wait)
{
    BOOST_TEST(
        monitor_texts(
            R"({"monitor.host":{"de":"Rechner","en":"Host"},"monitor.live":{"de":"Live"}})",
            {{"de",
              R"({"site.full":"Voll.","viewer.start":"Start","waiting.room":"Eng.","waiting.next":"?"})"},
             {"en", "broken"}}) ==
        R"({"de":{"monitor.host":"Rechner","monitor.live":"Live","site.full":"Voll.","waiting.room":"Eng."},)"
        R"("en":{"monitor.host":"Host"}})");
}

BOOST_AUTO_TEST_CASE(a_session_server_tells_what_the_page_cannot_know)
{
    SessionAbout about;
    about.started = WallTime(std::chrono::seconds(1'700'000'000));
    about.is_tls = false;
    about.is_gateway = true;
    auto const text = about_json(about);
    BOOST_TEST(contains(text, R"("started":1700000000,)"));
    BOOST_TEST(contains(text, R"("tls":false,"gateway":true,"decisions":false})"));
}

BOOST_AUTO_TEST_CASE(a_simulation_server_tells_every_figure_of_the_reference)
{
    SimulationAbout about;
    about.title = "Lab 7";
    about.description = "Ask Ada.";
    about.notices = {"", "Some limits are not kept."};
    about.host.system = "Debian GNU/Linux 12";
    about.host.name = "lab7";
    about.host.processor = "Fast \"One\"";
    about.host.cores = 16;
    about.host.threads_per_core = 2;
    about.host.memory_bytes = std::uint64_t{32} << 30;
    about.allowed = {"https://github.com/cyberbotics", "local:/demo"};
    about.registries = {"https://webots.cloud/ajax/server/setup.php", "odd"};
    auto const text = about_json(about);
    for (
        auto const* part :
        {R"("title":"Lab 7","description":"Ask Ada.","notices":["Some limits are not kept."])",
         R"("host":{"system":"Debian GNU/Linux 12","name":"lab7","processor":"Fast \"One\"","threads":16,"cores":8,)"
         R"("memory":34359738368})",
         R"("allowed":["https://github.com/cyberbotics","local:/demo"],"blocked":[])",
         R"("registries":["https://webots.cloud","odd"],"shareIdleTime":5E1)"})
        BOOST_TEST(contains(text, part), text);
    about.host.gpu = "2x NVIDIA T4 (15.8GB)";
    BOOST_TEST(contains(about_json(about), R"json("gpu":"2x NVIDIA T4 (15.8GB)")json"));
}

BOOST_AUTO_TEST_CASE(styles_scripts_texts_and_the_logo_stand_in_the_page_itself)
{
    MonitorPage page;
    page.title = "Webots session server";
    page.assets.styles = {"b{}"};
    page.assets.scripts = {"one();", "two();"};
    page.assets.texts = R"({"en":{}})";
    page.assets.logo = "<svg></svg>";
    page.assets.port = 1999;
    auto const html = monitor_page(page);
    BOOST_TEST(contains(html, "<style>\nb{}</style>"));
    BOOST_TEST(contains(html, R"(<script type="application/json" id="texts">{"en":{}}</script>)"));
    BOOST_TEST(html.find("id=\"snapshot\"") < html.find("one();"));
    BOOST_TEST(html.find("one();") < html.find("two();"));
    BOOST_TEST(contains(html, "<svg></svg><h1>"));
    BOOST_TEST(contains(html, "data-port=\"1999\""));
    BOOST_TEST(!contains(html, "src="));
}

BOOST_AUTO_TEST_SUITE_END()
