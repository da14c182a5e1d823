#include "unit_test.hpp"

#include "core/doctor/simulation_findings.hpp"

using namespace webots_cloud;
using namespace webots_cloud::core;

BOOST_AUTO_TEST_SUITE(simulation_findings)

BOOST_AUTO_TEST_CASE(webots_is_named_with_its_release)
{
    SimulatorReading reading;
    reading.program = "/usr/local/webots/webots";
    reading.version_text = "R2025a\n";
    BOOST_TEST((judge_simulator(reading) ==
                Finding(Verdict::ok, "simulator", "Webots R2025a, /usr/local/webots/webots")));
    reading.version_text.clear();
    BOOST_TEST((judge_simulator(reading).verdict == Verdict::warning));
}

BOOST_AUTO_TEST_CASE(the_demo_simulator_is_not_taken_for_webots)
{
    SimulatorReading reading;
    reading.program = "/opt/bin/webots-demo-simulator";
    reading.is_webots = false;
    auto const finding = judge_simulator(reading);
    BOOST_TEST((finding.verdict == Verdict::warning));
    BOOST_TEST(
        finding.found.starts_with("no Webots is installed: /opt/bin/webots-demo-simulator is the demo"));
    BOOST_TEST((judge_simulator(Failure(errc::not_found, "no Webots found")).verdict == Verdict::fault));
}

BOOST_AUTO_TEST_CASE(an_attempt_works_works_with_warnings_or_fails)
{
    AttemptReading reading;
    reading.description = "bubblewrap, public internet only";
    BOOST_TEST((judge_attempt("sandbox", "\"sandbox\"", reading) ==
                Finding(Verdict::ok, "sandbox", "bubblewrap, public internet only")));
    reading.warnings = {"Not so good.", "Not at all."};
    BOOST_TEST(
        (judge_attempt("sandbox", "\"sandbox\"", reading) ==
         Finding(Verdict::warning, "sandbox", "bubblewrap, public internet only: Not so good. Not at all.")));
    auto const failed = judge_attempt("sandbox", "\"sandbox\"", Failure(errc::start_failed, "no bwrap"));
    BOOST_TEST((failed.verdict == Verdict::fault));
    BOOST_TEST(failed.remedy == "Install what is missing, or change \"sandbox\" (docs/sandboxes.md).");
}

BOOST_AUTO_TEST_CASE(limits_that_are_not_kept_are_a_warning_with_a_remedy)
{
    auto const finding = judge_limits("Some are not kept.");
    BOOST_TEST((finding.verdict == Verdict::warning));
    BOOST_TEST(finding.found == "Some are not kept");
    BOOST_TEST(finding.remedy != "");
}

BOOST_AUTO_TEST_CASE(a_graphics_processor_has_to_be_there_and_ours_to_use)
{
    GraphicsReading reading;
    BOOST_TEST((judge_graphics(reading).verdict == Verdict::warning));
    reading.closed = {"/dev/dri/renderD128"};
    BOOST_TEST(judge_graphics(reading).found ==
               "there is a graphics processor, but this user may not use it: /dev/dri/renderD128");
    BOOST_TEST((judge_graphics(reading).verdict == Verdict::warning));
    reading.devices = {"/dev/dri/renderD129"};
    BOOST_TEST(
        (judge_graphics(reading) ==
         Finding(Verdict::ok, "graphics", "a graphics processor that may be used: /dev/dri/renderD129")));
    reading.models = "NVIDIA T4 (15.8GB)";
    BOOST_TEST(judge_graphics(reading).found == "NVIDIA T4 (15.8GB): /dev/dri/renderD129");
}

BOOST_AUTO_TEST_CASE(what_draws_is_better_no_processor)
{
    auto const judge = [](std::string const& name) {
        return judge_renderer(
            "name of display: :0\nOpenGL vendor string: x\nOpenGL renderer string: " + name + "\n");
    };
    BOOST_TEST((judge("NVIDIA T4/PCIe/SSE2") == Finding(Verdict::ok, "renderer", "NVIDIA T4/PCIe/SSE2")));
    BOOST_TEST((judge("llvmpipe (LLVM 15.0.6, 256 bits)").verdict == Verdict::warning));
    BOOST_TEST((judge_renderer(std::string("direct rendering: Yes\n")).verdict == Verdict::warning));
    BOOST_TEST((judge_renderer(Failure(errc::start_failed, "unable to open display :0")).found ==
                "OpenGL can't be tried: unable to open display :0"));
}

BOOST_AUTO_TEST_CASE(a_start_that_fails_is_told_with_what_the_simulator_printed)
{
    StartReading reading;
    reading.took = std::chrono::milliseconds(1500);
    BOOST_TEST((judge_start(reading) ==
                Finding(Verdict::ok, "start", "the simulator has loaded an empty world within 2 s")));
    reading.outcome = Failure(errc::start_failed, "Webots has ended: it exited with status 1.");
    reading.printed = {"error while loading", "libGL.so.1"};
    auto const broken = judge_start(reading);
    BOOST_TEST((broken.verdict == Verdict::fault));
    BOOST_TEST(broken.found == "the simulator does not load an empty world: Webots has ended: it exited with "
                               "status 1; it printed: error while loading | libGL.so.1");
}

BOOST_AUTO_TEST_CASE(docker_has_to_answer)
{
    BOOST_TEST((judge_docker("27.1\n") == Finding(Verdict::ok, "docker", "version 27.1")));
    BOOST_TEST((judge_docker(Failure(errc::unavailable, "not found")).verdict == Verdict::fault));
}

BOOST_AUTO_TEST_CASE(slurm_has_to_answer_and_to_have_a_partition)
{
    BOOST_TEST(
        (judge_slurm("cpu*\n", "/shared") ==
         Finding(Verdict::ok, "slurm",
                 "it answers; whether the nodes see /shared, Webots and the programs, a first job shows")));
    BOOST_TEST((judge_slurm("\n", "/shared").verdict == Verdict::fault));
    BOOST_TEST((judge_slurm(Failure(errc::unavailable, "not found"), "/shared").verdict == Verdict::fault));
}

BOOST_AUTO_TEST_SUITE_END()
