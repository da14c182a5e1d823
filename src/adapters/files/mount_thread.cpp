#include "mount_thread.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace webots_cloud {

class MountThread
{
public:
    MountThread() : thread_([this] { work(); }) { current = this; }
    MountThread(MountThread const&) = delete;

    ~MountThread()
    {
        current = nullptr;
        {
            std::lock_guard const lock(mutex_);
            stopping_ = true;
        }
        changed_.notify_all();
        thread_.join();
    }

    int run(std::function<int()> const& call)
    {
        std::lock_guard const turn(callers_);
        std::unique_lock lock(mutex_);
        call_ = &call;
        changed_.notify_all();
        changed_.wait(lock, [this] { return !call_; });
        return outcome_;
    }

    static inline std::atomic<MountThread*> current = nullptr;

private:
    void work()
    {
        std::unique_lock lock(mutex_);
        for (;;) {
            changed_.wait(lock, [this] { return call_ || stopping_; });
            if (!call_)
                return;
            outcome_ = (*call_)();
            call_ = nullptr;
            changed_.notify_all();
        }
    }

    std::mutex callers_; ///< One at a time.
    std::mutex mutex_;   ///< Guards the following.
    std::condition_variable changed_;
    std::function<int()> const* call_ = nullptr; ///< Null: nothing is to be done.
    int outcome_ = 0;
    bool stopping_ = false;
    std::thread thread_;
};

std::shared_ptr<MountThread> make_mount_thread()
{
    return std::make_shared<MountThread>();
}

namespace adapters {

int mount_elsewhere(std::function<int()> const& call)
{
    MountThread* const thread = MountThread::current;
    return thread ? thread->run(call) : call();
}

} // namespace adapters
} // namespace webots_cloud
