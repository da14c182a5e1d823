#include "unit_test.hpp"

#include <webots_cloud/load_report.hpp>

#include <boost/json.hpp>

using namespace webots_cloud;

// Protocol sections 4.2 and 13.
BOOST_AUTO_TEST_SUITE(load_report)

BOOST_AUTO_TEST_CASE(a_bare_number_is_a_load)
{
    BOOST_TEST(parse_load_report("7.875")->load == 7.875);
    BOOST_TEST(parse_load_report("0")->load == 0);
    BOOST_TEST(parse_load_report(" 12.5\n")->load == 12.5);
    BOOST_TEST(parse_load_report("1e2")->load == 100);
}

BOOST_AUTO_TEST_CASE(anything_else_is_no_load)
{
    for (auto const* body : {"",
                             " ",
                             "abc",
                             "nan",
                             "inf",
                             "-inf",
                             "-1",
                             "-0.1",
                             "1,5",
                             "12 34",
                             "0x10",
                             "<html>",
                             "1e999",
                             "{}",
                             "{\"load\":\"5\"}",
                             "{\"load\":-1}",
                             "{\"load\":1,\"sessions\":-1}",
                             "{\"load\":1,\"capacity\":1.5}",
                             "{\"load\":1,\"draining\":1}",
                             "{\"load\":1",
                             "[1]",
                             "{\"load\":1,\"memory\":-3}",
                             "{\"load\":1,\"labels\":\"gpu\"}",
                             "{\"load\":1,\"labels\":[1]}",
                             "{\"load\":1,\"labels\":[\"\"]}",
                             "{\"load\":1,\"labels\":[\"two words\"]}",
                             "{\"load\":1,\"arrivals\":-1}",
                             "{\"load\":1,\"arrivals\":1,\"failed\":0.5}",
                             "{\"load\":1,\"arrivals\":1,\"departures\":\"2\"}",
                             "{\"load\":1,\"arrivals\":9223372036854775808}"}) {
        auto const report = parse_load_report(body);
        BOOST_TEST(!report, body);
        BOOST_TEST((report.error() == errc::protocol_error), body);
    }
    BOOST_TEST(!parse_load_report(std::string(1'000'000, '9')));
}

BOOST_AUTO_TEST_CASE(our_own_servers_say_more_and_are_understood)
{
    LoadReport report(12.5);
    report.sessions = 3;
    report.starting = 1;
    report.capacity = 100;
    report.memory = 40.25;
    report.draining = true;
    report.arrivals = 9'223'372'036'854'775'807;
    report.failed = 2;
    report.departures = 0;
    report.labels = {"gpu", "R2025a"};
    BOOST_TEST(boost::json::parse(to_json(report, "1.2.3")) ==
               boost::json::parse(
                   R"({"load":12.5,"sessions":3,"starting":1,"capacity":100,"memory":40.25,"draining":true,
                       "arrivals":9223372036854775807,"failed":2,"departures":0,"labels":["gpu","R2025a"],"version":"1.2.3"})"));
    BOOST_TEST((parse_load_report(to_json(report, "1.2.3")).value() == report));
}

BOOST_AUTO_TEST_CASE(what_worlds_use_is_told_by_digests)
{
    LoadReport report(12.5);
    report.processors = 16;
    WorldUse& use = report.worlds.emplace_back();
    use.key = world_key("https://github.com/o/r/blob/main/worlds/w.wbt", "mjpeg");
    use.running = 3;
    use.starting = 1;
    use.processors = 2.5;
    use.memory = 1e9;
    use.graphics = 0.75;
    report.memory_bytes = 64e9;
    report.graphics_processors = 2;
    std::string const text = to_json(report, "1.2.3");
    BOOST_TEST((parse_load_report(text).value() == report));
    BOOST_TEST(text.find("github") == std::string::npos);
    BOOST_TEST(boost::json::parse(text).at("worlds").at(0).at("world").as_string().size() == 16u);
    report.worlds.clear();
    BOOST_TEST((parse_load_report(to_json(report, "1.2.3")).value() == report));
}

BOOST_AUTO_TEST_CASE(worlds_that_make_no_sense_are_no_report)
{
    auto const with = [](std::string const& processors, std::string const& worlds) {
        return parse_load_report(R"({"load":1,"processors":)" + processors + R"(,"worlds":[)" + worlds +
                                 "]}");
    };
    std::string const keys =
        R"("world":"0123456789abcdef","repository":"0123456789abcdef","mode":"0123456789abcdef")";
    BOOST_TEST(with("4", "{" + keys + "}").has_value());
    BOOST_TEST(
        with("4", "{" + keys + R"(,"running":2,"starting":1,"processors":0.5,"memory":1})").has_value());
    BOOST_TEST(!parse_load_report(R"({"load":1,"worlds":[]})"), "of how many processors?");
    for (auto const* bytes : {"0", "-1", "1e999", "\"4\""})
        BOOST_TEST(!with("4", std::string(R"(],"memoryBytes":)") + bytes + R"(,"x":[)"), bytes);
    BOOST_TEST(with("4", R"(],"memoryBytes":8e9,"x":[)")->memory_bytes.value() == 8e9);
    for (auto const* graphics : {"0", "-1", "1e999", "1e-9", "1e9", "\"4\""})
        BOOST_TEST(!with("4", std::string(R"(],"graphicsProcessors":)") + graphics + R"(,"x":[)"), graphics);
    for (auto const* processors : {"0", "-1", "1e999", "1e-9", "1e9", "\"4\""})
        BOOST_TEST(!with(processors, "{" + keys + "}"), processors);
    std::vector<std::string> const wrong = {
        std::string("1"),
        std::string("{}"),
        std::string(R"({"world":"0123456789abcdef"})"),
        "{" + keys + R"(,"running":-1})",
        "{" + keys + R"(,"starting":0.5})",
        "{" + keys + R"(,"processors":-1})",
        "{" + keys + R"(,"memory":"much"})",
        "{" + keys + R"(,"graphics":-1})",
        R"({"world":"0123456789abcde","repository":"0123456789abcdef","mode":"0123456789abcdef"})",
        R"({"world":"0123456789abcdeg","repository":"0123456789abcdef","mode":"0123456789abcdef"})",
        R"({"world":-1,"repository":"0123456789abcdef","mode":"0123456789abcdef"})"};
    for (auto const& entry : wrong)
        BOOST_TEST(!with("4", entry), entry);
    std::string many = "{" + keys + "}";
    for (int world = 2; world <= 64; ++world)
        many += ",{" + keys + "}";
    BOOST_TEST(with("4", many)->worlds.size() == LoadReport::max_worlds);
    BOOST_TEST(!with("4", many + ",{" + keys + "}"));
}

BOOST_AUTO_TEST_CASE(projects_are_one_string_of_digests)
{
    LoadReport report(12.5);
    report.projects = {0, 1, 0xffffffff, 0x12345678, 0xfedcba98};
    for (; !report.projects.empty(); report.projects.pop_back())
        BOOST_TEST((parse_load_report(to_json(report, "1")).value() == report));
    report.projects = {0x00000001, 0xfbefbefb};
    BOOST_TEST(boost::json::parse(to_json(report, "1")).at("projects") == "AAAAAfvvvvs");
    report.projects.assign(LoadReport::max_projects, 0xabcdef01);
    std::string const most = to_json(report, "1");
    BOOST_TEST(boost::json::parse(most).at("projects").as_string().size() == 683u);
    BOOST_TEST((parse_load_report(most).value() == report));
}

BOOST_AUTO_TEST_CASE(projects_that_make_no_sense_are_no_report)
{
    auto const with = [](std::string const& projects) {
        return parse_load_report(R"({"load":1,"projects":)" + projects + "}");
    };
    BOOST_TEST((with(R"("AAAAAQ")").value().projects == std::vector<std::uint32_t>{1}));
    BOOST_TEST(with(R"("")").value().projects.empty());
    for (auto const* wrong : {"1", "null", "[]", R"(["AAAAAQ"])", R"("AAAAA")", R"("AAAAAQA")", R"("AAAAAR")",
                              R"("AAAA=Q")", R"("AAAA+Q")", R"("AAAA Q")", R"("AAAAAQ==")"})
        BOOST_TEST(!with(wrong), wrong);
    BOOST_TEST(!with("\"" + std::string(688, 'A') + "\""), "129 digests");
}

BOOST_AUTO_TEST_CASE(a_world_is_known_by_any_link_to_it)
{
    auto const key = world_key("https://github.com/o/r/blob/main/worlds/w.wbt", "x3d");
    for (auto const* same :
         {"https://github.com/o/r/tree/main/worlds/w.wbt", "https://github.com/o/r/raw/main/worlds/w.wbt",
          "https://raw.githubusercontent.com/o/r/main/worlds/w.wbt",
          "https://github.com/o/r/blob/main/worlds/w.wbt?plain=1#L3"})
        BOOST_TEST((world_key(same, "x3d") == key), same);
    for (auto const* sibling :
         {"https://github.com/o/r/blob/x/worlds/w.wbt", "https://github.com/o/r/raw/main/worlds/x.wbt"}) {
        BOOST_TEST((world_key(sibling, "x3d").world != key.world), sibling);
        BOOST_TEST((world_key(sibling, "x3d").repository == key.repository), sibling);
    }
    BOOST_TEST((world_key("https://lab.org/o/r/src/tag/v1/worlds/w.wbt", "").world !=
                world_key("https://lab.org/o/r/src/branch/v1/worlds/w.wbt", "").world));
}

BOOST_AUTO_TEST_CASE(a_project_is_known_by_its_repository_ref_and_folder)
{
    std::uint32_t const key = project_key("https://github.com/o/r/blob/main/a/b/worlds/w.wbt");
    BOOST_TEST(key == project_key("https://github.com/o/r", "main/a/b"));
    for (auto const* same : {"https://github.com/o/r/blob/main/a/b/worlds/other.wbt",
                             "https://github.com/o/r/tree/main/a/b/worlds/w.wbt",
                             "https://github.com/o/r/raw/main/a/b/worlds/w.wbt",
                             "https://raw.githubusercontent.com/o/r/main/a/b/worlds/w.wbt",
                             "https://github.com/o/r/blob/main/a/%62/worlds/w.wbt?x#y"})
        BOOST_TEST(project_key(same) == key, same);
    BOOST_TEST(project_key("https://gitlab.com/g/s/r/-/blob/main/a/worlds/w.wbt") ==
               project_key("https://gitlab.com/g/s/r", "main/a"));
    BOOST_TEST(project_key("http://localhost:8080/git/o/r/src/tag/v1/worlds/w.wbt") ==
               project_key("http://localhost:8080/git/o/r", "refs/tags/v1"));
    for (auto const* other :
         {"https://github.com/o/r/blob/main/a/worlds/w.wbt",
          "https://github.com/o/r/blob/dev/a/b/worlds/w.wbt",
          "https://github.com/o/s/blob/main/a/b/worlds/w.wbt",
          "https://gitlab.com/o/r/blob/main/a/b/worlds/w.wbt", "https://github.com/o/r", "", "%", "/blob/"})
        BOOST_TEST(project_key(other) != key, other);
}

BOOST_AUTO_TEST_CASE(more_labels_than_a_machine_can_have_are_refused)
{
    std::string labels = R"("l1")";
    for (int label = 2; label <= 32; ++label)
        labels += ",\"l" + std::to_string(label) + '"';
    BOOST_TEST(parse_load_report(R"({"load":1,"labels":[)" + labels + "]}")->labels.size() == 32u);
    BOOST_TEST(!parse_load_report(R"({"load":1,"labels":[)" + labels + R"(,"l33"]})"));
}

BOOST_AUTO_TEST_CASE(the_refusal_quotes_what_was_found)
{
    BOOST_TEST(parse_load_report("<b>\n").error().message() ==
               "the load must be a number from 0 up, found \"<b>\\x0a\"");
}

BOOST_AUTO_TEST_SUITE_END()
