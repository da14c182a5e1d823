// Waits until no process of a tree is left, and ends it when the server wants that or has died.
#pragma once

#include "clock.hpp"
#include "job.hpp"
#include "pid_namespace.hpp"

#include <csignal>

#include <sys/types.h>

namespace webots_cloud::guard {

/// Waits for everything that can happen to a program and its tree, and ends them in time. One thread and one
/// `poll`: nothing here may wait for anything else.
class TreeWatch
{
public:
    /// `owner`: a pidfd of the server, or -1.
    TreeWatch(Started started, long grace_ms, int owner)
        : program_(started.process), report_(started.report), listening_(started.listening),
          grace_ms_(grace_ms), owner_(owner)
    {}

    /// For a program without a control socket, which is killed after `time_ms`.
    static TreeWatch with_time_limit(pid_t program, long time_ms)
    {
        Started started;
        started.process = program;
        TreeWatch watch(started, 0, -1);
        watch.kill_at_ = now_ms() + time_ms;
        watch.control_open_ = false;
        return watch;
    }

    /// Returns the status of the program when no process is left.
    int watch(int signals);

    /// In place of SIGTERM, which the first process of a namespace translates.
    void end_by(int signal) { end_signal_ = report_ >= 0 ? SIGTERM : signal; }

    /// There is no control socket; what is new of the program is to be told.
    void watch_job(Job& job, bool has_own_network)
    {
        job_ = &job;
        has_own_network_ = has_own_network;
        control_open_ = false;
    }

    /// Whether the server has died, or wants to know nothing more of this program.
    bool is_abandoned() const { return !control_open_ || owner_gone_; }

    /// Whether it was asked to end the program.
    bool is_asked_to_end() const { return kill_at_ >= 0 || owner_gone_; }

private:
    void read_control();
    void pass_report_on();
    void reap();
    void terminate();
    int wait_time();

    pid_t program_;
    int report_;
    int listening_; ///< -1: nothing is to be heard of the program's port any more.
    long grace_ms_;
    int owner_;         ///< -1: it is not watched, or has died.
    long kill_at_ = -1; ///< When the grace period ends; -1: nobody has asked the program to end.
    int end_signal_ = SIGTERM;
    int status_ = 0;
    bool killing_ = false;
    bool control_open_ = true;
    bool owner_gone_ = false;
    bool tree_is_gone_ = false;
    Job* job_ = nullptr; ///< Null: we run where the server does.
    bool has_own_network_ = false;
};

} // namespace webots_cloud::guard
