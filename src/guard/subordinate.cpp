#include "subordinate.hpp"

#include "descriptor.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace webots_cloud::guard {
namespace {

int complain(char const* what)
{
    std::printf("%s: %s\n", what, std::strerror(errno));
    return 1;
}

/// Has one of the two programs map us to root, and `first` and so on to 1 and so on.
bool map(char const* program, pid_t process, unsigned own, char const* first, char const* count)
{
    char number[16];
    char own_number[16];
    std::snprintf(number, sizeof number, "%d", process);
    std::snprintf(own_number, sizeof own_number, "%u", own);
    pid_t const child = fork();
    if (child == 0) {
        char const* const argv[] = {program, number, "0", own_number, "1", "1", first, count, nullptr};
        execv(program, const_cast<char**>(argv));
        complain(program);
        std::fflush(stdout);
        _exit(1);
    }
    int status = 0;
    while (child > 0 && waitpid(child, &status, 0) < 0 && errno == EINTR)
        continue;
    return child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

/// Outside of the namespace: in it, set-user-ID programs have no effect.
[[noreturn]] void map_when_ready(int ready, char** words, pid_t process)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    char byte = 0;
    bool const mapped = read(ready, &byte, 1) == 1 && map(words[0], process, getuid(), words[2], words[4]) &&
                        map(words[1], process, getgid(), words[3], words[4]);
    _exit(mapped ? 0 : 1);
}

} // namespace

int make_user_namespace(char** words)
{
    int ready[2];
    if (pipe2(ready, O_CLOEXEC) != 0)
        return complain("no pipe");
    pid_t const process = getpid();
    pid_t const child = fork();
    if (child == 0) {
        close(ready[1]);
        map_when_ready(ready[0], words, process);
    }
    if (child < 0 || unshare(CLONE_NEWUSER) != 0)
        return complain("no user namespace");
    prctl(PR_SET_DUMPABLE, 1); // otherwise we are root's in /proc, and newuidmap refuses
    int status = 1;
    bool const told = write(ready[1], "r", 1) == 1;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        continue;
    if (!told || status != 0)
        return 1; // newuidmap has said why
    int const made = open("/proc/self/ns/user", O_RDONLY | O_CLOEXEC);
    return made >= 0 && send_descriptor(STDIN_FILENO, made) ? 0 : complain("the user namespace is lost");
}

bool enter_user_namespace(int descriptor)
{
    bool const entered = setns(descriptor, CLONE_NEWUSER) == 0;
    int const error = errno;
    close(descriptor);
    errno = error;
    return entered && geteuid() == 0;
}

} // namespace webots_cloud::guard
