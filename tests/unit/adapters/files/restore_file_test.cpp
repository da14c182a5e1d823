#include "scratch_folder.hpp"
#include "unit_test.hpp"

#include "adapters/files/restore_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iterator>

using namespace webots_cloud;
using adapters::restore_file;
namespace fs = std::filesystem;

namespace {

/// A fetched project, changes by a simulation, and a file outside of it.
struct RestoringFilesFixture : ScratchFolder
{
    RestoringFilesFixture()
    {
        for (auto const* part : {"from/controllers/walk", "to/controllers/walk", "outside"})
            fs::create_directories(folder / part);
        write("from/controllers/walk/walk.py", "pristine");
        write("to/controllers/walk/walk.py", "changed");
        write("outside/walk.py", "secret");
    }
    void write(std::string const& path, std::string const& text) const
    {
        std::ofstream(folder / path) << text;
    }

    std::string read(std::string const& path) const
    {
        std::ifstream file(folder / path);
        return {std::istreambuf_iterator<char>(file), {}};
    }

    result<> restore(std::string const& file = "controllers/walk/walk.py") const
    {
        return restore_file(folder / "from", folder / "to", file);
    }
};

} // namespace

// Protocol section 4.1.1, item 1, and quirk Q26.
BOOST_FIXTURE_TEST_SUITE(restoring_files, RestoringFilesFixture)

BOOST_AUTO_TEST_CASE(a_file_is_put_back_with_its_permissions)
{
    fs::permissions(folder / "from/controllers/walk/walk.py", fs::perms(0755));
    BOOST_TEST(restore().has_value());
    BOOST_TEST(read("to/controllers/walk/walk.py") == "pristine");
    BOOST_TEST((fs::status(folder / "to/controllers/walk/walk.py").permissions() == fs::perms(0755)));
    BOOST_TEST(std::distance(fs::directory_iterator(folder / "to/controllers/walk"), {}) == 1);
}

BOOST_AUTO_TEST_CASE(a_file_or_folder_that_was_removed_comes_back)
{
    fs::remove_all(folder / "to/controllers");
    BOOST_TEST(restore().has_value());
    BOOST_TEST(read("to/controllers/walk/walk.py") == "pristine");
}

BOOST_AUTO_TEST_CASE(what_comes_back_belongs_to_the_user_of_the_folder)
{
    constexpr unsigned nobody = 65534;
    if (::geteuid() != 0) {
        BOOST_TEST_MESSAGE("skipped: only root can give folders away");
        return;
    }
    fs::remove_all(folder / "to/controllers");
    BOOST_TEST_REQUIRE(::chown((folder / "to").c_str(), nobody, nobody) == 0);
    BOOST_TEST(restore().has_value());
    for (auto const* path : {"to/controllers", "to/controllers/walk", "to/controllers/walk/walk.py"}) {
        struct stat status;
        BOOST_TEST_REQUIRE(::stat((folder / path).c_str(), &status) == 0);
        BOOST_TEST(status.st_uid == nobody, path);
        BOOST_TEST(status.st_gid == nobody, path);
    }
}

BOOST_AUTO_TEST_CASE(a_file_that_the_project_never_had_is_not_found)
{
    write("to/controllers/walk/new.py", "new");
    BOOST_TEST((restore("controllers/walk/new.py").error() == errc::not_found));
    BOOST_TEST((restore("controllers/walk").error() == errc::not_found)); // a folder, not a file
    BOOST_TEST(read("to/controllers/walk/new.py") == "new");
}

BOOST_AUTO_TEST_CASE(links_that_a_simulation_made_lead_nowhere)
{
    fs::remove(folder / "to/controllers/walk/walk.py");
    fs::create_symlink(folder / "outside/walk.py", folder / "to/controllers/walk/walk.py");
    BOOST_TEST(restore().has_value()); // the link is replaced, not followed
    BOOST_TEST(read("outside/walk.py") == "secret");
    BOOST_TEST(read("to/controllers/walk/walk.py") == "pristine");
    fs::remove_all(folder / "to/controllers/walk");
    fs::create_symlink(folder / "outside", folder / "to/controllers/walk");
    BOOST_TEST(restore().has_error());
    BOOST_TEST(read("outside/walk.py") == "secret");
}

BOOST_AUTO_TEST_CASE(links_of_the_project_are_not_read)
{
    fs::remove(folder / "from/controllers/walk/walk.py");
    fs::create_symlink(folder / "outside/walk.py", folder / "from/controllers/walk/walk.py");
    BOOST_TEST((restore().error() == errc::not_found));
    BOOST_TEST(read("to/controllers/walk/walk.py") == "changed");
}

BOOST_AUTO_TEST_CASE(a_left_over_of_an_interrupted_restore_is_in_nobodys_way)
{
    fs::create_symlink(folder / "outside/walk.py", folder / "to/controllers/walk/.webots_cloud-reset");
    BOOST_TEST(restore().has_value());
    BOOST_TEST(read("outside/walk.py") == "secret");
    BOOST_TEST(read("to/controllers/walk/walk.py") == "pristine");
}

BOOST_AUTO_TEST_SUITE_END()
