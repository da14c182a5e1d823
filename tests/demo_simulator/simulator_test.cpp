// The simulator with programs that the test plays itself.
#include "simulator.hpp"

#include <boost/test/unit_test.hpp>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <limits>

using namespace webots_cloud::demo;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(simulator_with_programs)

namespace {

struct Listeners : Audience
{
    void send(ClientId, Text text, bool) override { heard.push_back(*text); }
    void picture_changed() override {}
    void picture_resized() override { ++resized; }
    void mode_changed() override {}

    long count(std::string_view beginning) const
    {
        return std::count_if(heard.begin(), heard.end(),
                             [&](std::string const& text) { return text.starts_with(beginning); });
    }

    std::vector<std::string> heard;
    int resized = 0;
};

struct PlayedPrograms : Programs
{
    void start(std::vector<Program> programs, ProgramListener& simulator) override
    {
        started.push_back(std::move(programs));
        listener = &simulator;
    }
    void answer(std::size_t, std::string line) override { answers.push_back(std::move(line)); }
    void end(std::size_t robot, std::string const&) override { listener->program_ended(robot); }

    void ask(int duration)
    {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        listener->step_requested(0, {duration, {{infinity, 5}, {infinity, 5}}});
    }

    std::vector<std::vector<Program>> started;
    std::vector<std::string> answers;
    ProgramListener* listener = nullptr;
};

/// A project with one robot, whose program is `drive.py`.
struct Fixture
{
    Fixture()
    {
        auto pattern = (fs::temp_directory_path() / "webots_demo_programs_XXXXXX").string();
        BOOST_REQUIRE(::mkdtemp(pattern.data()) != nullptr);
        top = pattern;
        fs::create_directories(top / "worlds");
        fs::create_directories(top / "controllers/drive");
        std::ofstream(top / "worlds/a.wbt") << "#VRML_SIM R2025a utf8\nWorldInfo { basicTimeStep 32 }\n"
                                               "TwoWheeledRobot { name \"blue\" controller \"drive\" }\n";
        std::ofstream(top / "controllers/drive/drive.py") << "\n";
        options.world = top / "worlds/a.wbt";
        simulator.emplace(options, listeners, programs, [](std::string_view) {});
        simulator->load();
        simulator->connect(1);
        simulator->receive(1, "w3d;broadcast");
    }
    ~Fixture() { fs::remove_all(top); }

    /// Simulated milliseconds, as the program was told last.
    int time() const { return programs.answers.empty() ? 0 : std::atoi(programs.answers.back().c_str()); }

    fs::path top;
    Options options;
    Listeners listeners;
    PlayedPrograms programs;
    std::optional<Simulator> simulator;
};

} // namespace

BOOST_AUTO_TEST_CASE(a_program_is_found_beside_its_world)
{
    Fixture fixture;
    BOOST_REQUIRE(fixture.programs.started.size() == 1U);
    BOOST_REQUIRE(fixture.programs.started[0].size() == 1U);
    Program const& program = fixture.programs.started[0][0];
    BOOST_TEST(program.name == "drive");
    BOOST_TEST(program.file == fixture.top / "controllers/drive/drive.py");
    BOOST_TEST(program.greeting == "robot 32 blue");
}

BOOST_AUTO_TEST_CASE(only_the_first_viewer_decides_the_size_of_pictures_and_waits_for_no_other)
{
    Fixture fixture;
    fixture.simulator->disconnect(1);
    fixture.options.stream = StreamMode::mjpeg;
    fixture.simulator.emplace(fixture.options, fixture.listeners, fixture.programs, [](std::string_view) {});
    fixture.simulator->load();
    fixture.simulator->connect(1);
    fixture.simulator->connect(2);
    BOOST_TEST(!fixture.simulator->has_picture_size());
    fixture.simulator->receive(1, "mjpeg: 320x200");
    BOOST_TEST(fixture.simulator->has_picture_size());
    BOOST_TEST(fixture.listeners.resized == 1);
    fixture.simulator->receive(2, "mjpeg: 640x480");
    BOOST_TEST(fixture.listeners.resized == 1);
    BOOST_TEST(fixture.listeners.count("multimedia: mjpeg") == 2);
}

BOOST_AUTO_TEST_CASE(lines_that_nobody_has_heard_wait_for_the_first_who_joins)
{
    Fixture fixture;
    fixture.simulator->say("heard at once");
    BOOST_TEST(fixture.listeners.count("stdout:heard at once") == 1);
    fixture.simulator->disconnect(1);
    fixture.simulator->connect(2);
    fixture.simulator->say("one"); // 2 is connected, but has not joined
    fixture.simulator->say("two");
    BOOST_TEST(fixture.listeners.count("stdout:") == 1);
    fixture.simulator->receive(2, "w3d;broadcast");
    BOOST_REQUIRE(fixture.listeners.heard.size() > 1U);
    BOOST_TEST(fixture.listeners.heard.back() == "stdout:two");
    BOOST_TEST(fixture.listeners.count("stdout:") == 3);
    fixture.simulator->connect(3);
    fixture.simulator->receive(3, "w3d;broadcast");
    BOOST_TEST(fixture.listeners.count("stdout:") == 3);
}

BOOST_AUTO_TEST_CASE(steps_wait_for_the_program_and_then_come_at_once)
{
    Fixture fixture;
    fixture.simulator->advance(3);
    BOOST_TEST(fixture.programs.answers.empty()); // the program computes
    fixture.programs.ask(64);
    BOOST_TEST(fixture.time() == 64); // two of the three steps; then it computes again
    fixture.programs.ask(32);
    BOOST_TEST(fixture.time() == 96);
    fixture.programs.ask(32); // all three are done: it waits for the next
    BOOST_TEST(fixture.time() == 96);
    fixture.simulator->advance(1);
    BOOST_TEST(fixture.time() == 128);
}

BOOST_AUTO_TEST_CASE(browsers_are_not_told_the_same_state_again_while_a_program_computes)
{
    Fixture fixture;
    fixture.simulator->advance(1);
    auto const before = fixture.listeners.count("application/json:");
    for (int i = 0; i < 10; ++i)
        fixture.simulator->advance(1);
    BOOST_TEST(fixture.listeners.count("application/json:") == before);
    fixture.programs.ask(32);
    fixture.simulator->advance(1);
    BOOST_TEST(fixture.listeners.count("application/json:") == before + 1);
}

BOOST_AUTO_TEST_CASE(a_program_that_has_ended_holds_nobody_up)
{
    Fixture fixture;
    fixture.simulator->advance(1);
    fixture.programs.listener->program_printed("Traceback", Output::error);
    fixture.programs.listener->program_ended(0);
    BOOST_TEST(fixture.listeners.count("stderr:Traceback") == 1);
    auto const before = fixture.listeners.count("application/json:");
    fixture.simulator->advance(1);
    BOOST_TEST(fixture.listeners.count("application/json:") == before + 1);
}

BOOST_AUTO_TEST_CASE(a_program_that_asks_twice_is_ended)
{
    Fixture fixture;
    fixture.programs.ask(32);
    fixture.programs.ask(32);
    fixture.simulator->advance(1);
    BOOST_TEST(fixture.programs.answers.empty()); // it was told nothing: it has ended
}

BOOST_AUTO_TEST_CASE(a_paused_simulation_takes_single_steps)
{
    Fixture fixture;
    fixture.simulator->receive(1, "pause");
    fixture.simulator->receive(1, "step");
    BOOST_TEST(fixture.programs.answers.empty());
    fixture.programs.ask(32);
    BOOST_TEST(fixture.time() == 32); // the step had waited for it
    fixture.programs.ask(32);
    BOOST_TEST(fixture.time() == 32);
    fixture.simulator->receive(1, "step");
    BOOST_TEST(fixture.time() == 64);
}

BOOST_AUTO_TEST_CASE(reset_starts_the_programs_as_they_are_then)
{
    Fixture fixture;
    fs::remove(fixture.top / "controllers/drive/drive.py");
    fixture.simulator->receive(1, "reset");
    BOOST_REQUIRE(fixture.programs.started.size() == 2U);
    BOOST_TEST(fixture.programs.started[1].empty()); // it drives itself
    std::ofstream(fixture.top / "controllers/drive/drive.py") << "\n";
    fixture.simulator->receive(1, "reset");
    BOOST_REQUIRE(fixture.programs.started.size() == 3U);
    BOOST_TEST(fixture.programs.started[2].size() == 1U);
    fs::remove(fixture.top / "controllers/drive/drive.py");
    fs::create_symlink(fixture.top / "worlds/a.wbt", fixture.top / "controllers/drive/drive.py");
    fixture.simulator->receive(1, "reload");
    BOOST_REQUIRE(fixture.programs.started.size() == 4U);
    BOOST_TEST(fixture.programs.started[3].empty()); // a link is no program
}

BOOST_AUTO_TEST_SUITE_END()
