// Threads for work that the event loop must not do itself.
#pragma once

#include <boost/lockfree/queue.hpp>

#include <semaphore.h>

#include <atomic>
#include <concepts>
#include <cstddef>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {

/// Runs jobs in the order in which they are posted.
///
/// Like asio::thread_pool, but posting takes no lock that one of the threads may hold while it is preempted.
/// Nor does posting start a thread, which would wait in the kernel for others that start: there is one from
/// the beginning, and a thread that takes a job and leaves none idle starts the next.
///
/// Thread-safety: any thread posts.
class WorkerThreads
{
public:
    enum class Priority
    {
        normal,
        background ///< See lower_thread_priority().
    };

    class Job
    {
    public:
        Job() = default;
        Job(Job const&) = delete;
        Job& operator=(Job const&) = delete;
        virtual ~Job() = default;

        /// On one of the threads, to which it belongs from now on. Must not throw.
        virtual void run(std::unique_ptr<Job> self) = 0;
    };

    /// At most this many `threads`.
    explicit WorkerThreads(std::size_t threads, Priority priority = Priority::normal);

    /// Waits for running jobs; waiting jobs are destroyed.
    ~WorkerThreads();

    void post(std::unique_ptr<Job> job);

    /// Has a function called, which must not throw.
    template<class Work>
    requires std::invocable<Work&>
    void post(Work work) { post(std::make_unique<Call<Work>>(std::move(work))); }

    /// Waits until all jobs are done; none may be posted any more.
    void join();

private:
    template<class Work>
    class Call final : public Job
    {
    public:
        explicit Call(Work work) : work_(std::move(work)) {}
        void run(std::unique_ptr<Job>) override { work_(); }

    private:
        Work work_;
    };

    void start_another();
    void enqueue(Job* job);
    void work();

    Priority priority_;
    boost::lockfree::queue<Job*> jobs_; ///< Null: the thread that takes it ends, and passes it on.
    ::sem_t waiting_{}; ///< As many as there are jobs. That of libstdc++ may lose a wake-up (GCC bug 98033).
    std::atomic<bool> stopping_ = false;
    std::atomic<std::size_t> idle_ = 0; ///< Threads without a job.
    std::mutex starting_;               ///< Guards the following; `post` never takes it.
    std::size_t max_;
    std::vector<std::thread> threads_;
};

} // namespace webots_cloud::adapters
