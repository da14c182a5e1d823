// Makes the user namespace whose other users run simulations. One part runs as the server's user, with
// newuidmap; the other as root, before the service starts, for units of systemd. Decision 013 has the
// reasons.
#include "subordinate.hpp"

#include "descriptor.hpp"

#include <fcntl.h>
#include <grp.h>
#include <linux/nsfs.h>
#include <linux/securebits.h>
#include <mntent.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace webots_cloud::guard {
namespace {

// 0x74000000 to 0x77FFFFFF: beside those of simulations of root's servers (core/sandbox/simulation_user.cpp).
constexpr unsigned first_pinned = 0x7400'0000;
constexpr unsigned ranges = 1024;             // the one of a user follows from its number
constexpr unsigned users_of_range = 0x1'0000; // one for each port
constexpr char const* pinned = ".users";      // after the name of the folder
constexpr int max_mounts = 16;                // on each other

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

/// Tells the service's journal.
int complain_to_journal(char const* path, char const* what)
{
    std::fprintf(stderr, "simulations will share the server's user: %s: %s: %s\n", path, what,
                 std::strerror(errno));
    return 1;
}

/// Becomes the owner of a new user namespace: says over the socket what came of it (`errno`), and ends with
/// our parent.
[[noreturn]] void own_namespace(int socket, uid_t user, gid_t group)
{
    // All capabilities stay, so that this works even where only root may make user namespaces.
    prctl(PR_SET_SECUREBITS, SECBIT_NO_SETUID_FIXUP);
    bool const made = setgroups(0, nullptr) == 0 && setresgid(group, group, group) == 0 &&
                      setresuid(user, user, user) == 0 && unshare(CLONE_NEWUSER) == 0;
    int const error = made ? 0 : errno;
    char nothing = 0;
    if (write(socket, &error, sizeof error) == static_cast<ssize_t>(sizeof error))
        while (read(socket, &nothing, 1) < 0 && errno == EINTR)
            continue;
    _exit(0);
}

/// Maps `own` to 0, and the numbers from `first` on to 1 and so on.   False: `errno` says why not.
bool write_map(pid_t process, char const* map, unsigned own, unsigned first)
{
    char path[64];
    char text[96];
    std::snprintf(path, sizeof path, "/proc/%d/%s", process, map);
    int const size =
        std::snprintf(text, sizeof text, "0 %u 1\n1 %u %u\n", own, first, users_of_range); // at once
    int const file = open(path, O_WRONLY | O_CLOEXEC);
    bool const written = file >= 0 && write(file, text, static_cast<std::size_t>(size)) == size;
    int const error = errno;
    if (file >= 0)
        close(file);
    errno = error;
    return written;
}

/// systemd runs root's commands of a unit that has mounts of its own in mounts of their own, too. What we
/// mount is for the program that has started us.   False: `errno` says why not.
bool join_mounts_of_parent()
{
    char path[64];
    std::snprintf(path, sizeof path, "/proc/%d/ns/mnt", getppid());
    int const mounts = open(path, O_RDONLY | O_CLOEXEC);
    bool const joined = mounts >= 0 && setns(mounts, CLONE_NEWNS) == 0;
    int const error = errno;
    if (mounts >= 0)
        close(mounts);
    errno = error;
    return joined;
}

/// Pins the namespace of this process to the file that is open here.
bool pin(pid_t process, int place)
{
    char from[64];
    char to[64];
    std::snprintf(from, sizeof from, "/proc/%d/ns/user", process);
    std::snprintf(to, sizeof to, "/proc/self/fd/%d", place);
    return mount(from, to, nullptr, MS_BIND, nullptr) == 0;
}

/// Makes the namespace of a user, and pins it.   False: `errno` says why not.
bool pin_namespace_of(uid_t user, gid_t group, int place)
{
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        return false;
    pid_t const owner = fork();
    if (owner == 0) {
        close(ends[0]);
        own_namespace(ends[1], user, group);
    }
    close(ends[1]);
    int error = owner < 0 ? errno : EPIPE; // it has died
    if (owner > 0)
        (void)!read(ends[0], &error, sizeof error);
    unsigned const first = first_pinned + user % ranges * users_of_range;
    if (error == 0 && !(write_map(owner, "uid_map", user, first) &&
                        write_map(owner, "gid_map", group, first) && pin(owner, place)))
        error = errno;
    // The owner waits for this, and ends. The namespace stays, as it is pinned.
    close(ends[0]);
    while (owner > 0 && waitpid(owner, nullptr, 0) < 0 && errno == EINTR)
        continue;
    errno = error;
    return error == 0;
}

/// The owner of the user namespace that is pinned to a file.   False: it is none.
bool owner_of_pinned(char const* file, uid_t& owner)
{
    int const opened = open(file, O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC);
    bool const found = opened >= 0 && ioctl(opened, NS_GET_NSTYPE) == CLONE_NEWUSER &&
                       ioctl(opened, NS_GET_OWNER_UID, &owner) == 0;
    if (opened >= 0)
        close(opened);
    return found;
}

/// There are more users than ranges: looks for another one whose service runs and has the range of this one.
bool find_rival(uid_t user, uid_t& rival)
{
    FILE* const mounts = setmntent("/proc/self/mounts", "re");
    bool found = false;
    while (mntent const* const each = mounts && !found ? getmntent(mounts) : nullptr)
        found = std::strcmp(each->mnt_type, "nsfs") == 0 && owner_of_pinned(each->mnt_dir, rival) &&
                rival != user && rival % ranges == user % ranges;
    if (mounts)
        endmntent(mounts);
    return found;
}

void complain_of_rival(uid_t user, uid_t rival)
{
    std::fprintf(stderr,
                 "simulations will share the server's user: a service of user %u has the numbers of user %u. "
                 "Let one of them run as another user: these two differ by a multiple of %u\n",
                 rival, user, ranges);
}

/// False: `errno` says why it is still there.
bool unpin(char const* file)
{
    for (int i = 0; i < max_mounts && umount2(file, MNT_DETACH | UMOUNT_NOFOLLOW) == 0; ++i)
        continue;
    return unlink(file) == 0 || errno == ENOENT;
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

int pin_user_namespace(char const* folder)
{
    if (!join_mounts_of_parent())
        return complain_to_journal(folder, "only root can do this");
    struct stat owner;
    if (stat(folder, &owner) != 0)
        return complain_to_journal(folder, "there is no such folder");
    if (owner.st_uid == 0)
        return 0; // root's simulations are other users without this
    char file[PATH_MAX];
    std::snprintf(file, sizeof file, "%s%s", folder, pinned);
    if (!unpin(file)) // of a service that was killed
        return complain_to_journal(file, "what is there can't be removed");
    int const place = open(file, O_RDONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, S_IRUSR | S_IWUSR);
    if (place < 0)
        return complain_to_journal(file, "can't make the file");
    bool const is_pinned = pin_namespace_of(owner.st_uid, owner.st_gid, place);
    uid_t rival = 0;
    if (!is_pinned)
        complain_to_journal(file, "can't make a user namespace");
    else if (!find_rival(owner.st_uid, rival)) // now, so that of two that start together none is overlooked
        return 0;
    else
        complain_of_rival(owner.st_uid, rival);
    unpin(file);
    return 1;
}

int unpin_user_namespace(char const* folder)
{
    char file[PATH_MAX];
    std::snprintf(file, sizeof file, "%s%s", folder, pinned);
    if (join_mounts_of_parent() && unpin(file))
        return 0;
    std::fprintf(stderr, "%s can't be removed: %s\n", file, std::strerror(errno));
    return 1;
}

} // namespace webots_cloud::guard
