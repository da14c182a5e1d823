// Sends the project to the node as the job's input, and unpacks it there in a folder that is locked while its
// guard lives: an unlocked one is a dead guard's, and may be removed.
#include "job_folder.hpp"

#include "exit_status.hpp"
#include "folders.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

namespace webots_cloud::guard {
namespace {

constexpr int as_folder = O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC;

/// Only returns when it can't be executed.
void become_tar(std::vector<char const*> arguments)
{
    setenv("LC_ALL", "C", 1); // the server reads what is wrong
    arguments.insert(arguments.begin(), "tar");
    arguments.push_back(nullptr);
    execvp("tar", const_cast<char* const*>(arguments.data()));
}

/// Packs the paths into `output`; the paths in there begin at the root, as "var/lib/...".
[[noreturn]] void become_sender(char const* const* paths, int count, int output)
{
    dup2(output, STDOUT_FILENO);
    std::vector<char const*> arguments{"--create", "--file=-", "--directory=/", "--"};
    for (int i = 0; i < count; ++i)
        arguments.push_back(paths[i] + 1);
    become_tar(arguments);
    std::fprintf(stderr, "tar: can't be run (%s)\n", std::strerror(errno));
    _exit(exec_failed);
}

/// Whether `folder` is what has this name in `parent`, and not what had it before.
bool has_name(int folder, int parent, char const* name)
{
    struct stat opened;
    struct stat named;
    return fstat(folder, &opened) == 0 && fstatat(parent, name, &named, AT_SYMLINK_NOFOLLOW) == 0 &&
           opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

/// Removes one of our folders if its guard does not live any more.
void remove_if_left(int parent, char const* name)
{
    struct stat status;
    int const folder = openat(parent, name, as_folder);
    if (folder < 0)
        return;
    if (fstat(folder, &status) == 0 && status.st_uid == geteuid() && flock(folder, LOCK_EX | LOCK_NB) == 0)
        remove_folder(parent, name);
    close(folder);
}

void remove_left_overs(int parent, std::string const& beginning)
{
    DIR* const entries = fdopendir(openat(parent, ".", as_folder));
    if (!entries)
        return;
    while (dirent const* const entry = readdir(entries))
        if (std::strncmp(entry->d_name, beginning.c_str(), beginning.size()) == 0)
            remove_if_left(parent, entry->d_name);
    closedir(entries);
}

} // namespace

int take_sent(int& argc, char**& argv)
{
    if (argc == 0 || std::strcmp(argv[0], "--send") != 0)
        return 0;
    int const count = argc > 1 ? std::atoi(argv[1]) : 0;
    if (count < 1 || count > argc - 2)
        return -1;
    for (int i = 0; i < count; ++i) {
        argv[i] = argv[i + 2];
        if (argv[i][0] != '/')
            return -1;
    }
    argc -= count + 2;
    argv += count + 2;
    return count;
}

bool send_files(char const* const* paths, int count)
{
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0)
        return false;
    pid_t const program = getpid();
    pid_t const watcher = fork();
    if (watcher != 0)
        return watcher > 0 && dup2(ends[0], STDIN_FILENO) == STDIN_FILENO;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    pid_t const tar = fork();
    if (tar == 0)
        become_sender(paths, count, ends[1]);
    close(ends[0]); // the other end stays open until a failure has been told
    int status = 0;
    bool const is_sent =
        tar > 0 && waitpid(tar, &status, 0) == tar && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (!is_sent && getppid() == program) {
        std::printf("webots-process-guard can't send\n");
        std::fflush(stdout);
        kill(program, SIGTERM);
    }
    _exit(0);
}

bool JobFolder::make(char const* path)
{
    char const* const slash = std::strrchr(path, '/');
    if (!slash || !std::strchr(slash, '.')) {
        errno = EINVAL;
        return false;
    }
    name_ = slash + 1;
    parent_ = open(std::string(path, slash + 1).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (parent_ < 0)
        return false;
    remove_left_overs(parent_, std::string(name_, std::strchr(name_, '.') + 1));
    // Until it is locked, others take it for a left-over.
    do {
        if (lock_ >= 0)
            close(lock_);
        lock_ = mkdirat(parent_, name_, S_IRWXU) == 0 ? openat(parent_, name_, as_folder) : -1;
        if (lock_ < 0 && errno != ENOENT)
            return false;
    } while (lock_ < 0 || flock(lock_, LOCK_EX) != 0 || !has_name(lock_, parent_, name_));
    return true;
}

void JobFolder::remove()
{
    if (lock_ >= 0 && !remove_folder(parent_, name_))
        std::fprintf(stderr, "%s can't be removed: %s\n", name_, std::strerror(errno));
    for (int* const each : {&lock_, &parent_}) {
        if (*each >= 0)
            close(*each);
        *each = -1;
    }
}

void receive_files(char const* folder)
{
    pid_t const tar = fork();
    if (tar == 0) {
        become_tar(
            {"--extract", "--file=-", "--directory", folder, "--no-same-owner", "--no-same-permissions"});
        std::fprintf(stderr, "tar: can't be run (%s)\n", std::strerror(errno));
        _exit(exec_failed);
    }
    int status = 0;
    if (tar < 0 || waitpid(tar, &status, 0) != tar || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
        _exit(exec_failed);
    // A tar that has failed ends its archive, too: the sender has told so before it closes its end.
    char rest[512];
    while (read(STDIN_FILENO, rest, sizeof rest) > 0)
        continue;
    _exit(0);
}

} // namespace webots_cloud::guard
