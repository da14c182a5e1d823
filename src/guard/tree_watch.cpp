#include "tree_watch.hpp"

#include <poll.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

namespace webots_cloud::guard {
namespace {

/// Sends SIGKILL to every child. As they die, their children become ours, and get it in the next round.
void kill_children()
{
    char path[64];
    std::snprintf(path, sizeof path, "/proc/self/task/%d/children", getpid());
    std::FILE* const children = std::fopen(path, "re");
    if (!children)
        return;
    for (int child = 0; std::fscanf(children, "%d", &child) == 1;)
        kill(child, SIGKILL);
    std::fclose(children);
}

} // namespace

void TreeWatch::terminate()
{
    if (kill_at_ >= 0)
        return;
    kill_at_ = now_ms() + grace_ms_;
    if (program_ > 0)
        kill(program_, end_signal_);
}

void TreeWatch::read_control()
{
    char bytes[16];
    ssize_t const size = read(STDIN_FILENO, bytes, sizeof bytes);
    if (size > 0)
        terminate();
    else if (size == 0 || (errno != EINTR && errno != EAGAIN)) {
        control_open_ = false;
        killing_ = true;
    }
}

/// Tells the server that the program's port can be reached. On a node of a cluster our next look finds that.
void TreeWatch::pass_report_on()
{
    char byte = 0;
    ssize_t const size = read(listening_, &byte, 1);
    if (size < 0 && errno == EINTR)
        return;
    if (size == 1 && control_open_)
        send(STDIN_FILENO, "L", 1, MSG_NOSIGNAL | MSG_DONTWAIT);
    close(listening_); // also at its end: the relay is gone, and the program with it
    listening_ = -1;
}

void TreeWatch::reap()
{
    int status = 0;
    pid_t ended = 0;
    while ((ended = waitpid(-1, &status, WNOHANG)) > 0) {
        if (ended != program_)
            continue;
        int reported = 0;
        bool const has_report = report_ >= 0 && read(report_, &reported, sizeof reported) ==
                                                    static_cast<ssize_t>(sizeof reported);
        status_ = has_report ? reported : status;
        program_ = -1;
        killing_ = true; // the rest of the tree is of no use without the program
    }
    tree_is_gone_ = ended < 0 && errno == ECHILD;
}

int TreeWatch::wait_time()
{
    if (killing_)
        return 10; // children of killed processes become ours one by one
    if (kill_at_ < 0)
        return job_ ? tell_news(*job_, program_, has_own_network_) : -1;
    long const left = kill_at_ - now_ms();
    return left > 0 ? static_cast<int>(left) : 0;
}

int TreeWatch::watch(int signals)
{
    for (;;) {
        // Whatever has woken us: several children may have ended for one SIGCHLD.
        reap();
        if (tree_is_gone_)
            return status_;
        if (kill_at_ >= 0 && now_ms() >= kill_at_)
            killing_ = true;
        if (killing_)
            kill_children();
        pollfd watched[] = {{signals, POLLIN, 0},
                            {control_open_ ? STDIN_FILENO : -1, POLLIN, 0},
                            {owner_, POLLIN, 0},
                            {listening_, POLLIN, 0}};
        if (poll(watched, 4, wait_time()) <= 0)
            continue;
        if (watched[3].revents != 0)
            pass_report_on();
        if (watched[1].revents != 0)
            read_control();
        if (watched[2].revents != 0) {
            // A process that has ended stays readable: without this, `poll` would not wait any more.
            owner_ = -1;
            owner_gone_ = true;
            killing_ = true;
        }
        signalfd_siginfo info{};
        if ((watched[0].revents & POLLIN) != 0 &&
            read(signals, &info, sizeof info) == static_cast<ssize_t>(sizeof info) &&
            info.ssi_signo != SIGCHLD)
            terminate();
    }
}

} // namespace webots_cloud::guard
