#include "execution.hpp"

#include "exit_status.hpp"
#include "job_folder.hpp"
#include "limits.hpp"
#include "privileges.hpp"
#include "user.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace webots_cloud::guard {
namespace {

/// Where a file is not there, it is an empty one.
void open_files(Program const& program)
{
    for (int i = 0; i < program.opened_count; ++i) {
        int const wanted = std::atoi(program.opened[2 * i]);
        int file = open(program.opened[2 * i + 1], O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
        if (file < 0)
            file = open("/dev/null", O_RDONLY | O_CLOEXEC);
        if (file == wanted)
            fcntl(file, F_SETFD, 0);
        else
            dup2(file, wanted);
    }
}

[[noreturn]] void refuse_without_limits(Program const& program)
{
    std::printf("can't set the limits of %s: %s\n", program.argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

/// Once it is in its groups.
[[noreturn]] void execute_in_groups(Program const& program)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL); // in case somebody kills the guard itself
    // A group of its own: what signals that group does not mean us.
    setpgid(0, 0);
    sigprocmask(SIG_SETMASK, &program.signals, nullptr);
    int const nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
    dup2(nothing, STDIN_FILENO);
    // Standard error of a job is for our own lines.
    if (program.is_job)
        dup2(STDOUT_FILENO, STDERR_FILENO);
    if (program.sent_count > 0 && !send_files(program.sent, program.sent_count)) {
        std::printf("webots-process-guard can't send\n");
        std::fflush(stdout);
        _exit(exec_failed);
    }
    if (!set_limits(program.limits))
        refuse_without_limits(program);
    open_files(program);
    execv(program.argv[0], program.argv);
    std::printf("can't run %s: %s\n", program.argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

} // namespace

void execute(Program const& program)
{
    if (!enter_groups(program.limits))
        refuse_without_limits(program);
    execute_in_groups(program);
}

void execute_confined(Program const& program)
{
    if (!enter_groups(program.limits)) // as long as this is the server's user
        refuse_without_limits(program);
    if (!program.set_user_id && !program.own_sandbox)
        drop_capabilities();
    if (program.user.is_other && !become(program.user)) {
        std::printf("can't run %s as user %u: %s\n", program.argv[0], program.user.user,
                    std::strerror(errno));
        std::fflush(stdout);
        _exit(exec_failed);
    }
    if (program.user.is_other && !program.set_user_id)
        prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    execute_in_groups(program);
}

void execute_confined_without_namespace(Program const& program)
{
    if (!program.set_user_id)
        confine_signals();
    execute_confined(program);
}

} // namespace webots_cloud::guard
