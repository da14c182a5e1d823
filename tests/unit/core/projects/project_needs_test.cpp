#include "unit_test.hpp"

#include "core/projects/project_needs.hpp"

using namespace webots_cloud;

// Protocol 6.3.
BOOST_AUTO_TEST_SUITE(project_needs)

using Labels = std::vector<std::string>;

namespace {

Labels labels_of(std::string_view text)
{
    auto const needs = core::project_needs(text);
    BOOST_TEST_REQUIRE(needs.has_value());
    return needs->labels;
}

} // namespace

BOOST_AUTO_TEST_CASE(a_project_names_labels_in_its_webots_yml)
{
    BOOST_TEST((labels_of("publish: true\nlabels: gpu other\ntype: demo\n") == Labels{"gpu", "other"}));
    BOOST_TEST((labels_of("labels:gpu\r\nlabels:  big-memory   gpu ") == Labels{"gpu", "big-memory"}));
    for (auto const* text : {"", "labels:", "labels: \r\n", " labels: gpu", "Labels: gpu", "#labels: gpu"})
        BOOST_TEST(labels_of(text).empty(), text);
}

BOOST_AUTO_TEST_CASE(containers_are_needed_where_there_is_something_to_compose)
{
    auto const needs = core::project_needs("labels: gpu\ndockerCompose:theia:x\n");
    BOOST_TEST(needs->containers);
    BOOST_TEST((needs->labels == Labels{"gpu"}));
    BOOST_TEST((needs->all() == Labels{"gpu", "docker"}));
    BOOST_TEST((core::project_needs("labels: docker\ndockerCompose:theia:x")->all() == Labels{"docker"}));
    BOOST_TEST(!core::project_needs("labels: gpu\n#dockerCompose:theia:x")->containers);
    BOOST_TEST((core::project_needs("labels: gpu")->all() == Labels{"gpu"}));
}

BOOST_AUTO_TEST_CASE(what_is_no_label_is_refused_in_words)
{
    for (auto const* line : {"labels: gpu,other", "labels: [gpu]", "labels: \"gpu\"", "labels: ä",
                             "labels: a b c d e f g h i"}) {
        auto const needs = core::project_needs(line);
        BOOST_TEST_REQUIRE(!needs.has_value(), line);
        BOOST_TEST(needs.error() == errc::invalid_argument);
        BOOST_TEST(needs.error().message().starts_with("Wrong line in webots.yml: \"labels: "));
    }
    BOOST_TEST(labels_of("labels: a b c d e f g h a").size() == core::max_needed_labels);
    BOOST_TEST(!core::project_needs("labels: " + std::string(41, 'a')).has_value());
}

BOOST_AUTO_TEST_CASE(a_machine_lacks_what_is_not_among_its_labels)
{
    BOOST_TEST(core::lacking({}, {}).empty());
    BOOST_TEST(core::lacking({"gpu"}, {"R2025a", "gpu"}).empty());
    BOOST_TEST((core::lacking({"gpu", "docker", "x"}, {"docker"}) == Labels{"gpu", "x"}));
    BOOST_TEST(core::lacks_labels({"gpu", "x"}).message() ==
               "This simulation server can't run the project: it lacks what webots.yml asks for: gpu, x. "
               "Please start it on another one.");
    BOOST_TEST(core::lacks_labels({"gpu"}) == errc::refused);
}

BOOST_AUTO_TEST_SUITE_END()
