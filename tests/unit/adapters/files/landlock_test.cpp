#include "unit_test.hpp"

#include "adapters/files/mount_thread.hpp"

#include <webots_cloud/adapters.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <thread>

using namespace webots_cloud;
namespace fs = std::filesystem;

BOOST_AUTO_TEST_SUITE(landlock)

namespace {

constexpr int has_no_landlock = 77;

struct Folder
{
    Folder()
    {
        std::string name = "/tmp/webots_cloud_landlock_XXXXXX";
        path = ::mkdtemp(name.data());
        for (auto const* each : {"read", "write", "other"}) {
            fs::create_directory(path / each);
            std::ofstream(path / each / "file") << "text";
        }
    }
    ~Folder() { fs::remove_all(path); }

    fs::path path;
};

bool can_open(fs::path const& path, int flags)
{
    int const opened = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
    if (opened >= 0)
        ::close(opened);
    return opened >= 0;
}

bool can_execute(char const* program)
{
    auto const child = ::fork();
    if (child == 0) {
        ::execl(program, program, static_cast<char*>(nullptr));
        ::_exit(126);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return status == 0;
}

OwnFiles read_and_write(Folder const& folder)
{
    OwnFiles files;
    files.read = {folder.path / "read", folder.path / "missing"};
    files.write = {folder.path / "write", "/dev/null"};
    return files;
}

/// The exit status of a process that is confined, and then does something.
template<class Action>
int confined(OwnFiles const& files, Action action)
{
    auto const child = ::fork();
    if (child == 0) {
        auto const done = confine_to_files(files);
        ::_exit(done ? action() : has_no_landlock);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// Which of these fails first: 0: none.
int first_that_fails(std::initializer_list<bool> checks)
{
    int number = 0;
    for (bool const holds : checks) {
        ++number;
        if (!holds)
            return number;
    }
    return 0;
}

bool is_skipped(int status)
{
    if (status == has_no_landlock)
        BOOST_TEST_MESSAGE("skipped: this kernel has no Landlock");
    return status == has_no_landlock;
}

} // namespace

BOOST_AUTO_TEST_CASE(what_is_named_can_be_used_also_what_comes_later)
{
    Folder const folder;
    auto const& path = folder.path;
    auto const status = confined(read_and_write(folder), [&] {
        auto const renewed = path / "write/renewed";
        return first_that_fails(
            {can_open(path / "read/file", O_RDONLY), can_open(path / "write/file", O_RDWR),
             can_open(renewed, O_WRONLY | O_CREAT | O_EXCL),
             can_open(path / "write/file", O_WRONLY | O_TRUNC),
             ::rename(renewed.c_str(), (path / "write/file").c_str()) == 0,
             ::unlink((path / "write/file").c_str()) == 0,
             ::mkdir((path / "write/folder").c_str(), 0700) == 0, can_open("/dev/null", O_RDWR)});
    });
    if (!is_skipped(status))
        BOOST_TEST(status == 0);
}

BOOST_AUTO_TEST_CASE(nothing_else_can_be_opened_or_executed)
{
    Folder const folder;
    auto const& path = folder.path;
    auto const status = confined(read_and_write(folder), [&] {
        return first_that_fails({!can_open(path / "other/file", O_RDONLY), !can_open("/etc/passwd", O_RDONLY),
                                 !can_open("/etc/shadow", O_RDONLY), !can_open(path / "read/file", O_WRONLY),
                                 !can_open(path / "read/new", O_WRONLY | O_CREAT),
                                 !can_open(path / "other/new", O_WRONLY | O_CREAT),
                                 ::unlink((path / "read/file").c_str()) != 0,
                                 ::link((path / "other/file").c_str(), (path / "write/linked").c_str()) != 0,
                                 !can_execute("/usr/bin/true")});
    });
    if (!is_skipped(status))
        BOOST_TEST(status == 0);
    BOOST_TEST(can_open(path / "other/file", O_RDONLY)); // only that process was confined
}

BOOST_AUTO_TEST_CASE(in_folders_to_be_tidied_empty_folders_are_removed_and_nothing_else)
{
    Folder const folder;
    auto const& path = folder.path;
    fs::create_directory(path / "other/empty");
    OwnFiles files;
    files.tidy = {path / "other"};
    auto const status = confined(files, [&] {
        return first_that_fails(
            {::rmdir((path / "other/empty").c_str()) == 0, !can_open(path / "other/file", O_RDONLY),
             ::unlink((path / "other/file").c_str()) != 0, ::mkdir((path / "other/new").c_str(), 0700) != 0});
    });
    if (!is_skipped(status))
        BOOST_TEST(status == 0);
}

BOOST_AUTO_TEST_CASE(a_thread_is_confined_alone_with_what_it_starts_while_earlier_ones_mount_and_open)
{
    Folder const folder;
    auto const& path = folder.path;
    auto const child = ::fork(); // for the sake of what is confined
    if (child == 0) {
        auto const mounts = make_mount_thread();
        OwnFiles files;
        files.write = {path / "write"};
        auto const done = confine_to_files(files);
        bool can_later = true;
        std::thread([&] { can_later = can_open(path / "other/file", O_RDONLY); }).join();
        bool const can_earlier =
            adapters::mount_elsewhere([&] { return can_open(path / "other/file", O_RDONLY) ? 1 : 0; }) == 1;
        bool const here = can_open(path / "other/file", O_RDONLY);
        bool const by_link = ::symlink((path / "other").c_str(), (path / "write/link").c_str()) == 0 &&
                             can_open(path / "write/link/new", O_WRONLY | O_CREAT);
        ::_exit(!done ? has_no_landlock : first_that_fails({!can_later, can_earlier, !here, !by_link}));
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    if (!is_skipped(WIFEXITED(status) ? WEXITSTATUS(status) : -1))
        BOOST_TEST(status == 0);
}

BOOST_AUTO_TEST_SUITE_END()
