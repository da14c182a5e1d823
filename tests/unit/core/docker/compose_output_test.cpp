#include "unit_test.hpp"

#include "core/docker/compose_output.hpp"

#include <ostream>
#include <string>
#include <vector>

using namespace webots_cloud::core;

// Protocol sections 4.1.3 and 6.4.
BOOST_AUTO_TEST_SUITE(compose_output)

namespace {

constexpr auto project = "webots-2000-1f3a9c4d-aa-17";
constexpr auto image = "cyberbotics/webots.cloud:R2099a-ubuntu22.04";

using Source = ComposeLine::Source;

bool reads(std::string_view line, Source source, std::string_view text)
{
    return parse_compose_line(line, project) == ComposeLine(source, text);
}

std::string why_failed(std::vector<std::string> const& lines)
{
    StartWords words;
    for (auto const& line : lines)
        words.of_compose(line);
    return words.text();
}

} // namespace

BOOST_AUTO_TEST_CASE(what_the_simulator_prints_is_cut_after_the_bar_in_every_version_of_compose)
{
    BOOST_TEST(reads("webots-2000-1f3a9c4d-aa-17-webots-1  | .", Source::webots, "."));
    BOOST_TEST(reads("webots-1  | pause", Source::webots, "pause"));
    BOOST_TEST(reads("webots_1  | real-time", Source::webots, "real-time"));
    BOOST_TEST(reads("webots-2000-1f3a9c4d-aa-17_webots_1  | a | b", Source::webots, "a | b"));
    BOOST_TEST(reads("webots_1      | ", Source::webots, ""));
    BOOST_TEST(reads("webots_1|", Source::webots, ""));
}

BOOST_AUTO_TEST_CASE(what_erases_the_line_of_a_terminal_is_not_of_the_line)
{
    BOOST_TEST(reads("\x1b[2Kwebots-1  | .", Source::webots, "."));
    BOOST_TEST(reads("\x1b[2Kcontroller-1  | .", Source::other, "."));
    BOOST_TEST(reads("\x1b[1;31mAttaching to webots-1", Source::compose, "Attaching to webots-1"));
    BOOST_TEST(reads("\x1b[91m\x1b[0mThe command", Source::compose, "The command"));
    BOOST_TEST(reads("\x1b[2;", Source::compose, ""));
    BOOST_TEST(reads("\x1b[2K", Source::compose, ""));
}

BOOST_AUTO_TEST_CASE(other_containers_are_not_taken_for_the_simulator)
{
    BOOST_TEST(reads("controller-1  | .", Source::other, "."));
    BOOST_TEST(reads("theia_1       | webots_1 | .", Source::other, "webots_1 | ."));
    BOOST_TEST(reads("webots-2000-1f3a9c4d-aa-1-webots-1 | .", Source::other, "."));
}

BOOST_AUTO_TEST_CASE(the_lines_of_a_build_stay_whole)
{
    BOOST_TEST(reads("Step 3/7 : RUN cat a | sort", Source::compose, "Step 3/7 : RUN cat a | sort"));
    BOOST_TEST(reads("Creating network \"x_default\" with the default driver", Source::compose,
                     "Creating network \"x_default\" with the default driver"));
    BOOST_TEST(reads(".", Source::compose, "."));
    BOOST_TEST(reads("", Source::compose, ""));
    BOOST_TEST(reads("|", Source::compose, "|"));
}

BOOST_AUTO_TEST_CASE(the_end_of_the_simulator_is_noticed_while_other_containers_run)
{
    BOOST_TEST(reads("webots-1 exited with code 0", Source::webots_end, "webots-1 exited with code 0"));
    BOOST_TEST(
        (parse_compose_line("webots-2000-1f3a9c4d-aa-17_webots_1 exited with code 137", project).source ==
         Source::webots_end));
    BOOST_TEST((parse_compose_line("controller-1 exited with code 0", project).source == Source::compose));
}

BOOST_AUTO_TEST_CASE(names_of_simulations_are_left_out)
{
    BOOST_TEST(without_project("Creating webots-2000-1f3a9c4d-aa-17_webots_1 ... done", project) ==
               "Creating simulation_webots_1 ... done");
    BOOST_TEST(without_project("webots-2000-1f3a9c4d-aa-17 webots-2000-1f3a9c4d-aa-17", project) ==
               "simulation simulation");
    BOOST_TEST(without_project("Step 1/7 : ARG A", project) == "Step 1/7 : ARG A");
    BOOST_TEST(without_project("Step 1/7 : ARG A", "") == "Step 1/7 : ARG A"); // there is no project
}

BOOST_AUTO_TEST_CASE(browsers_see_everything_but_empty_lines_and_the_editor)
{
    BOOST_TEST(is_progress("Step 1/7 : ARG WEBOTS_DEFAULT_IMAGE"));
    BOOST_TEST(!is_progress(" \r"));
    BOOST_TEST(!is_progress("theia_1 | ready"));
    BOOST_TEST(!is_progress("Pulling theia"));
}

BOOST_AUTO_TEST_CASE(an_image_that_does_not_exist_is_told_from_other_things_that_a_build_misses)
{
    BOOST_TEST(says_image_is_missing(
        "manifest for cyberbotics/webots.cloud:R2099a-ubuntu22.04 not found: manifest unknown", image));
    BOOST_TEST(
        says_image_is_missing("docker.io/cyberbotics/webots.cloud:R2099a-ubuntu22.04: not found", image));
    BOOST_TEST(says_image_is_missing("manifest unknown", image)); // as some registries say, and no more
    BOOST_TEST(!says_image_is_missing("make: g++: command not found", image));
}

BOOST_AUTO_TEST_CASE(of_an_image_that_cannot_be_fetched_the_engines_own_words_are_the_reason)
{
    // Each as docker 20.10 prints it where a registry answers with 429, 401, 403, 500, or is not there.
    for (std::string const reason :
         {"toomanyrequests: You have reached your pull rate limit.", "unauthorized", "denied",
          "error parsing HTTP 429 response body: invalid character 's' looking for beginning of value: \"s\"",
          "Head \"http://127.0.0.1:5000/v2/webots/manifests/R2025a\": no basic auth credentials",
          "received unexpected HTTP status: 500 Internal Server Error",
          "Get \"http://127.0.0.1:9/v2/\": dial tcp 127.0.0.1:9: connect: connection refused"}) {
        BOOST_TEST(
            why_failed({"Step 1/9 : ARG WEBOTS_DEFAULT_IMAGE", "Step 2/9 : FROM ${WEBOTS_DEFAULT_IMAGE}",
                        reason, "Service 'webots' failed to build : Build failed\r"}) ==
            "The image can't be fetched: " + reason);
        // The image of the participant, after that of the simulator.
        BOOST_TEST(
            why_failed({"Step 8/9 : RUN apt-get install x", "debconf: unable to initialize frontend: Dialog",
                        " ---> 0123456789ab", "Step 9/9 : LABEL a=b", "Successfully built 0123456789ab",
                        "Building controller", "Step 1/3 : FROM x/y:1", "1: Pulling from x/y", reason}) ==
            "The image can't be fetched: " + reason);
        // That of the editor, which is not built.
        BOOST_TEST(why_failed({"Step 8/9 : RUN make", "make: warning: no such file: ignored",
                               "Step 9/9 : LABEL a=b", "Successfully tagged simulation_webots:latest",
                               "Pulling theia (x/y:1)...", reason}) == reason);
    }
}

BOOST_AUTO_TEST_CASE(of_a_step_that_fails_its_last_error_is_the_reason_and_of_a_container_the_engines)
{
    BOOST_TEST(why_failed({}) == "");
    BOOST_TEST(why_failed({"Step 1/9 : FROM x"}) == "");
    BOOST_TEST(
        why_failed({"Step 3/9 : RUN make || echo failed", " ---> Running in 0123456789ab", "a.c:1: error: x",
                    "make: [a.o] 1", "The command '/bin/sh -c make' returned a non-zero code: 2",
                    "ERROR: Service 'webots' failed to build : Build failed"}) == "a.c:1: error: x");
    BOOST_TEST(
        why_failed({"Step 3/9 : RUN false", "The command '/bin/sh -c false' returned a non-zero code: 1",
                    "Service 'webots' failed to build : Build failed"}) ==
        "The command '/bin/sh -c false' returned a non-zero code: 1");
    auto const killed = why_failed({"Step 3/9 : RUN x", "The command 'x' returned a non-zero code: 137\r"});
    BOOST_TEST(killed.starts_with("A step of the build failed, since it was killed: "));
    BOOST_TEST(killed.ends_with(" The command 'x' returned a non-zero code: 137"));
    BOOST_TEST(why_failed({"Step 9/9 : LABEL a=b", "Creating simulation_webots_1 ... error",
                           "ERROR: for webots  Cannot start service webots: no such device",
                           "Encountered errors while bringing up the project."}) ==
               "ERROR: for webots  Cannot start service webots: no such device");
    StartWords words;
    words.of_compose("Attaching to webots_1");
    words.of_simulator("webots: fatal");
    words.of_compose("Stopping webots_1 ... done");
    BOOST_TEST(words.text() == "webots: fatal");
}

BOOST_AUTO_TEST_SUITE_END()
