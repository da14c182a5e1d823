#include "controller_files.hpp"

#include <boost/test/unit_test.hpp>

#include <cstdlib>
#include <fstream>
#include <iterator>

using namespace webots_cloud::demo;
namespace fs = std::filesystem;

namespace {

/// A project in a folder of its own, with a secret beside it.
struct Project
{
    Project()
    {
        auto pattern = (fs::temp_directory_path() / "webots_demo_controllers_XXXXXX").string();
        BOOST_REQUIRE(::mkdtemp(pattern.data()) != nullptr);
        top = pattern;
        world = top / "project" / "worlds" / "a.wbt";
        write("secret.py", "CRUISE = 1\n");
    }
    ~Project() { fs::remove_all(top); }

    void write(fs::path const& name, std::string const& text) const
    {
        fs::create_directories((top / name).parent_path());
        std::ofstream(top / name, std::ios::binary) << text;
    }

    std::string read(fs::path const& name) const
    {
        std::ifstream stream(top / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(stream), {}};
    }

    /// How fast a robot drives whose controller says that.
    double cruise(std::string const& text) const
    {
        write("project/controllers/drive/drive.py", text);
        World one = world_with("drive");
        read_cruise(one, world);
        warnings = one.warnings;
        return one.robots.front().cruise;
    }

    static World world_with(std::string const& controller)
    {
        return world_from_text("#VRML_SIM R2025a utf8\nSomeRobot { controller \"" + controller + "\" }\n");
    }

    fs::path top;
    fs::path world;
    mutable std::vector<std::string> warnings;
};

} // namespace

BOOST_AUTO_TEST_SUITE(controller_files_of_a_project)

BOOST_AUTO_TEST_CASE(robots_are_as_fast_as_their_controller_says)
{
    Project const project;
    BOOST_TEST(project.cruise("CRUISE = 2.5\n") == 2.5);
    BOOST_TEST(project.cruise("import x\nCRUISE=-3  # backwards\r\nCRUISE = 5\n") == -3);
    BOOST_TEST(project.cruise("CRUISE = 1e9") == max_cruise);
    BOOST_TEST(project.warnings.empty());
    for (char const* text : {"", "cruise = 1", " CRUISE = 1", "CRUISER = 1", "# CRUISE = 1"})
        BOOST_TEST(project.cruise(text) == default_cruise, text);
    BOOST_TEST(project.warnings.empty());
    for (char const* text : {"CRUISE = fast", "CRUISE = 1 + 1", "CRUISE 1", "CRUISE ="}) {
        BOOST_TEST(project.cruise(text) == default_cruise, text);
        BOOST_TEST(project.warnings.size() == 1u, text);
    }
}

BOOST_AUTO_TEST_CASE(a_controller_outside_of_the_project_is_none)
{
    Project const project;
    project.write("project/controllers/drive/drive.py", "");
    fs::create_directories(project.top / "project/controllers/linked");
    fs::create_symlink(project.top / "secret.py", project.top / "project/controllers/linked/linked.py");
    for (char const* name : {"../../secret", "..", "linked", "nobody", "<none>"}) {
        World world = Project::world_with(name);
        read_cruise(world, project.world);
        BOOST_TEST(world.robots.front().cruise == default_cruise, name);
        BOOST_TEST(controller_files(project.world, name).empty(), name);
    }
}

BOOST_AUTO_TEST_CASE(the_file_that_runs_comes_first_and_runtime_ini_not_at_all)
{
    Project const project;
    for (char const* name : {"a.py", "drive.py", "runtime.ini", ".hidden", "folder/x.py"})
        project.write(fs::path("project/controllers/drive") / name, name);
    project.write("project/controllers/drive/binary", "\xff\xfe");
    auto const files = controller_files(project.world, "drive");
    BOOST_REQUIRE(files.size() == 2u);
    BOOST_TEST(files[0].name == "drive.py");
    BOOST_TEST(files[0].content == "drive.py");
    BOOST_TEST(files[1].name == "a.py");
}

BOOST_AUTO_TEST_CASE(a_file_is_changed_where_it_is_and_nowhere_else)
{
    Project const project;
    project.write("project/controllers/drive/drive.py", "something long");
    BOOST_TEST(save_controller_file(project.world, "drive", "drive.py", "short") == "");
    BOOST_TEST(project.read("project/controllers/drive/drive.py") == "short");
    BOOST_TEST(save_controller_file(project.world, "drive", "new.py", "") == "");
    fs::create_symlink(project.top / "secret.py", project.top / "project/controllers/drive/link.py");
    for (char const* file : {"link.py", "../../../secret.py", "..", "", ".x", "/tmp/x"})
        BOOST_TEST(save_controller_file(project.world, "drive", file, "x") != "", file);
    for (char const* controller : {"../..", "nobody", "", "."})
        BOOST_TEST(save_controller_file(project.world, controller, "secret.py", "x") != "", controller);
    BOOST_TEST(save_controller_file(project.world, "drive", "a.py", std::string(1 << 19, 'x')) != "");
    BOOST_TEST(project.read("secret.py") == "CRUISE = 1\n");
}

BOOST_AUTO_TEST_CASE(an_executable_comes_before_python_and_python_before_what_is_not_compiled)
{
    Project const project;
    fs::path const folder = project.top / "project/controllers/drive";
    World world = world_from_text("#VRML_SIM R2025a utf8\nTwoWheeledRobot { controller \"drive\" }\n");
    RobotDescription const& robot = world.robots.front();
    auto const found = [&] {
        find_programs(world, project.world);
        return robot.program.filename().string();
    };
    BOOST_TEST(found() == "");
    project.write("project/controllers/drive/drive.h", "");
    BOOST_TEST(found() == "");
    project.write("project/controllers/drive/other.cpp", "");
    BOOST_TEST(found() == "other.cpp");
    BOOST_TEST((robot.program_kind == ProgramKind::source));
    project.write("project/controllers/drive/drive.py", "");
    BOOST_TEST(found() == "drive.py");
    BOOST_TEST((robot.program_kind == ProgramKind::python));
    project.write("project/controllers/drive/drive", "");
    BOOST_TEST(found() == "drive.py");
    fs::permissions(folder / "drive", fs::perms::owner_all);
    BOOST_TEST(found() == "drive");
    BOOST_TEST((robot.program_kind == ProgramKind::executable));
    fs::remove(folder / "drive");
    fs::create_symlink("/bin/true", folder / "drive");
    BOOST_TEST(found() == "drive.py");
}

BOOST_AUTO_TEST_SUITE_END()
