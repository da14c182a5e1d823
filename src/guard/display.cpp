// Starts Xvfb where only the program sees its socket and password, and then becomes the program. Its memory
// and time count as the program's, since it lives in the same namespaces and groups. Getting ready takes it
// longer than all else that we do for a start, so the program does not wait for it: the socket listens first.
#include "display.hpp"

#include "clock.hpp"
#include "exit_status.hpp"
#include "network.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/random.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

namespace webots_cloud::guard {
namespace {

constexpr char const* display_folder = "/tmp/.X11-unix";
constexpr char const* authority_file = "/tmp/.X11-unix/authority";

/// X servers of others than root want to find it.
void make_folder()
{
    if (mkdir(display_folder, 01777) == 0)
        chmod(display_folder, 01777); // the mask does not count
}

/// What the X server may print, of which the last line counts: the end of it.
class Tail
{
public:
    /// False: nothing follows.
    bool read_from(int output)
    {
        std::array<char, 256> bytes;
        auto const size = read(output, bytes.data(), bytes.size());
        if (size < 0)
            return errno == EINTR;
        for (ssize_t i = 0; i < size; ++i)
            add(bytes[static_cast<std::size_t>(i)]);
        return size > 0;
    }

    /// The last line with a word in it; empty: there was none.
    char const* line()
    {
        add('\n');
        return last_.data();
    }

private:
    void add(char byte)
    {
        constexpr std::size_t shortest = 8; // lines of fatal errors are framed by "(EE) "
        if (byte != '\n') {
            if (size_ < current_.size() - 1)
                current_[size_++] = byte >= ' ' && byte <= '~' ? byte : '?';
            return;
        }
        current_[size_] = '\0';
        if (size_ >= shortest)
            last_ = current_;
        size_ = 0;
    }

    std::array<char, 200> current_{};
    std::array<char, 200> last_{};
    std::size_t size_ = 0;
};

/// Writes the password of the display, 128 random bits, as X servers and their clients read it
/// (`Xau(3)`).   False: `errno` says why not.
bool write_authority()
{
    constexpr char protocol[] = "MIT-MAGIC-COOKIE-1";
    constexpr unsigned char name_size = sizeof protocol - 1;
    constexpr unsigned char key_size = 16;
    // Family "any", without an address and a display number: those of the display are not known yet.
    constexpr std::array<unsigned char, 6> whose{0xff, 0xff, 0, 0, 0, 0};
    std::array<unsigned char, whose.size() + 2 + name_size + 2 + key_size> entry{};
    auto next = std::copy(whose.begin(), whose.end(), entry.begin());
    *++next = name_size;
    next = std::copy(protocol, protocol + name_size, next + 1);
    *++next = key_size;
    if (getrandom(next + 1, key_size, 0) != key_size)
        return false;
    int const file = open(authority_file, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (file < 0)
        return false;
    bool const written = write(file, entry.data(), entry.size()) == static_cast<ssize_t>(entry.size());
    close(file);
    return written;
}

/// The display of a program.
struct Display
{
    char name[16] = ""; ///< `:<number>`
    int acceptor = -1;  ///< Its socket, which listens; -1: the X server makes it.
};

/// Whether an X server takes over a socket that listens already: then it names the function for that of
/// systemd's library.
bool takes_sockets(char const* server)
{
    constexpr char name[] = "sd_listen_fds";
    int const file = open(server, O_RDONLY | O_CLOEXEC);
    struct stat status
    {};
    bool found = false;
    if (file >= 0 && fstat(file, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0) {
        auto const size = static_cast<std::size_t>(status.st_size);
        void* const bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, file, 0);
        if (bytes != MAP_FAILED) {
            found = memmem(bytes, size, name, sizeof name - 1) != nullptr;
            munmap(bytes, size);
        }
    }
    close(file);
    return found;
}

/// A socket of the display that listens.   -1: there is none.
int listen_on(char const* display)
{
    constexpr int backlog = 128; // of connections that wait until the X server is ready
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::snprintf(address.sun_path, sizeof address.sun_path, "%s/X%s", display_folder, display + 1);
    int const made = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (made >= 0 && bind(made, reinterpret_cast<sockaddr const*>(&address), sizeof address) == 0 &&
        listen(made, backlog) == 0)
        return made;
    close(made);
    return -1;
}

/// Gives the X server the socket as sd_listen_fds(3) describes it: as descriptor 3. `environment` gets the
/// variables for it.
void pass_socket(int acceptor, char const** environment)
{
    constexpr int first_passed = 3; // SD_LISTEN_FDS_START
    static char process[32];
    std::snprintf(process, sizeof process, "LISTEN_PID=%d", getpid());
    environment[0] = "LISTEN_FDS=1";
    environment[1] = process;
    if (acceptor == first_passed)
        fcntl(acceptor, F_SETFD, 0);
    else
        dup2(acceptor, first_passed);
}

/// In the child: executes the X server, which writes its number to `ready` when it takes connections.
[[noreturn]] void execute_server(char const* server, Display const& display, int ready, int output)
{
    constexpr int beyond_passed = 4; // descriptors
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(output, STDOUT_FILENO);
    dup2(output, STDERR_FILENO);
    ready = fcntl(ready, F_DUPFD, beyond_passed);
    char ready_fd[16];
    std::snprintf(ready_fd, sizeof ready_fd, "%d", ready);
    // "local" are the abstract sockets, which all programs of a network namespace reach.
    char const* const argv[] = {server,         display.name, "-displayfd", ready_fd,       "-auth",
                                authority_file, "-nolisten",  "tcp",        "-nolisten",    "local",
                                "-noreset",     "-screen",    "0",          "1280x1024x24", "+extension",
                                "GLX",          nullptr};
    // Not the program's own: libraries that are meant for it could keep the X server from starting.
    char const* environment[] = {"PATH=/usr/local/bin:/usr/bin:/bin", nullptr, nullptr, nullptr};
    if (display.acceptor >= 0)
        pass_socket(display.acceptor, environment + 1);
    execve(server, const_cast<char* const*>(argv), const_cast<char* const*>(environment));
    std::printf("can't run %s: %s\n", server, std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

/// Writes a line; there is nobody to tell when that fails.
void say(int to, char const* text, char const* reason)
{
    char line[300];
    int const size = std::snprintf(line, sizeof line, "%s: %s\n", text, reason);
    if (size > 0 && write(to, line, std::min(static_cast<std::size_t>(size), sizeof line - 1)) < 0)
        return;
}

/// There is no display, or none any more: says so to the program that waits for it (`report`), or else ends
/// the program.
[[noreturn]] void give_up(pid_t program, int report, char const* reason)
{
    if (report >= 0) {
        say(report, "can't start a display for the simulation", reason);
    } else {
        say(STDOUT_FILENO, "\ndisplay has ended", reason); // the program may not have ended its own line
        kill(program, SIGKILL);
    }
    _exit(0);
}

/// Runs the X server for `program`, whose descriptor is `watched_program`. `report`, which is closed when the
/// display is ready, gets an empty line then, or why it is not; -1: the program does not wait.
[[noreturn]] void serve(char const* server, int limit_ms, pid_t program, int watched_program,
                        Display const& display, int report)
{
    setsid(); // a program that signals its process group does not mean us
    int ready[2];
    int output[2];
    if (pipe2(ready, O_CLOEXEC) != 0 || pipe2(output, O_CLOEXEC) != 0)
        give_up(program, report, std::strerror(errno));
    pid_t const child = fork();
    if (child == 0)
        execute_server(server, display, ready[1], output[1]);
    close(ready[1]);
    close(output[1]);
    Tail tail;
    char const* reason = nullptr;
    bool is_ready = false;
    long const deadline = now_ms() + limit_ms;
    for (bool lives = child > 0; lives;) {
        long const left = deadline - now_ms();
        if (!is_ready && left <= 0) {
            reason = "it does not get ready";
            break;
        }
        pollfd watched[] = {
            {output[0], POLLIN, 0}, {is_ready ? -1 : ready[0], POLLIN, 0}, {watched_program, POLLIN, 0}};
        if (poll(watched, 3, is_ready ? -1 : static_cast<int>(left)) <= 0)
            continue;
        if (watched[2].revents != 0) { // a sandbox may wait until we have ended, too
            kill(child, SIGKILL);
            _exit(0);
        }
        if (watched[0].revents != 0)
            lives = tail.read_from(output[0]);
        char byte = 0;
        if (watched[1].revents != 0 && (lives = read(ready[0], &byte, 1) == 1) && byte == '\n') {
            is_ready = true;
            close(display.acceptor); // whoever connects after the end of the X server is to be refused
            lives = report < 0 || write(report, "\n", 1) == 1;
            close(std::exchange(report, -1));
        }
    }
    if (child > 0)
        kill(child, SIGKILL);
    fcntl(output[0], F_SETFL, O_NONBLOCK); // what the X server has started may still have the other end
    while (tail.read_from(output[0]))
        continue;
    if (!reason)
        reason = *tail.line() != '\0' ? tail.line() : "it has ended";
    give_up(program, report, reason);
}

/// Starts `serve` as nobody's child: the program would not expect one that it has not started.
/// Returns: whether it runs.
bool start_serving(char const* server, int limit_ms, Display const& display, int report)
{
    pid_t const program = getpid();
    // Here: when `serve` begins, a short program may have ended, and its number be another one's.
    auto const watched_program = static_cast<int>(syscall(SYS_pidfd_open, program, 0));
    pid_t const child = watched_program >= 0 ? fork() : -1;
    if (child == 0) {
        pid_t const serving = fork();
        if (serving == 0)
            serve(server, limit_ms, program, watched_program, display, report);
        _exit(serving > 0 ? 0 : 1);
    }
    close(watched_program);
    return ends_well(child);
}

/// Returns: whether the X server is ready; else a line has been printed.
bool start_and_wait(char const* server, int limit_ms, Display const& display)
{
    int report[2];
    if (pipe2(report, O_CLOEXEC) != 0)
        return false;
    bool const serves = start_serving(server, limit_ms, display, report[1]);
    close(report[1]);
    char line[300] = "";
    std::size_t size = 0;
    for (ssize_t more = 1; serves && (more > 0 || (more < 0 && errno == EINTR));) {
        more = read(report[0], line + size, sizeof line - size);
        size += more > 0 ? static_cast<std::size_t>(more) : 0;
    }
    close(report[0]);
    if (size == 1 && line[0] == '\n')
        return true;
    if (size == 0)
        std::printf("can't start a display for the simulation\n");
    else
        std::printf("%.*s", static_cast<int>(size), line);
    return false;
}

/// Starts the X server for a program that does not wait for it.   False: a line has been printed.
bool start_beside(char const* server, int limit_ms, Display const& display)
{
    constexpr int no_report = -1;
    bool const serves = start_serving(server, limit_ms, display, no_report);
    if (!serves)
        std::printf("can't start a display for the simulation\n");
    return serves;
}

} // namespace

bool make_display_folder()
{
    make_folder();
    return mount("displays", display_folder, "tmpfs", MS_NOSUID | MS_NODEV | MS_NOEXEC,
                 "mode=1777,size=64k,nr_inodes=64") == 0;
}

void execute_on_display(char const* server, int limit_ms, char** argv)
{
    make_folder();
    if (!write_authority()) {
        std::printf("can't start a display for the simulation: %s: %s\n", authority_file,
                    std::strerror(errno));
        std::fflush(stdout);
        _exit(1);
    }
    Display display;
    std::snprintf(display.name, sizeof display.name, ":%d", getpid());
    bool const has_program = argv[0] != nullptr;
    if (takes_sockets(server))
        display.acceptor = listen_on(display.name);
    // Unless its socket listens already, the program would find no display yet. Without a program, this is a
    // trial, and waits for the result.
    bool const waits = display.acceptor < 0 || !has_program;
    if (!(waits ? start_and_wait(server, limit_ms, display) : start_beside(server, limit_ms, display))) {
        std::fflush(stdout);
        _exit(1);
    }
    if (!has_program)
        _exit(0);
    setenv("DISPLAY", display.name, 1);
    setenv("XAUTHORITY", authority_file, 1);
    unsetenv("WAYLAND_DISPLAY"); // toolkits would prefer that
    execv(argv[0], argv);
    std::printf("can't run %s: %s\n", argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

} // namespace webots_cloud::guard
