// What a guard leaves behind that was killed.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/readable_pipe.hpp>
#include <boost/asio/steady_timer.hpp>

#include <sys/types.h>

#include <functional>
#include <memory>

namespace webots_cloud::adapters {

/// Sends SIGKILL to all processes whose standard output or standard error is the pipe `pipe` (an inode).
/// Those whose descriptors we may not look into are left.   Thread: one that may wait, for milliseconds.
void end_writers(ino_t pipe);

/// A guard that is killed takes its tree along, unless the first process of the tree was stopped before its
/// first instruction (docs/decisions/005). Nobody knows of that process, but it has the output that it got
/// from the guard, which therefore does not end. This ends it when a guard has ended and its output has not.
///
/// Lifetime: shared, with what it has begun.   Thread-safety: one executor.
class Orphans : public std::enable_shared_from_this<Orphans>
{
public:
    /// `end_writers` on a thread of its own.
    using EndWriters = std::function<boost::asio::awaitable<void>(ino_t pipe)>;

    /// `guard`: a child that has not been waited for. Where there is no descriptor left to watch it with,
    /// nothing is ended.
    Orphans(boost::asio::readable_pipe& output, pid_t guard, EndWriters end);

    /// While somebody reads the output.
    void watch();
    void rest();

    /// Whether the output goes on although nobody was found who could be ended: then reading was cancelled.
    bool are_out_of_reach() const noexcept { return looks_ > max_looks; }

private:
    void look();

    boost::asio::readable_pipe& output_;
    ino_t pipe_ = 0;
    boost::asio::posix::stream_descriptor guard_; ///< A pidfd; closed: there is none.
    boost::asio::steady_timer timer_;
    EndWriters end_writers_;
    bool watches_ = false;
    int looks_ = 0;

    static constexpr int max_looks = 10;
};

} // namespace webots_cloud::adapters
