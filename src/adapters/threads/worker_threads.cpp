#include "worker_threads.hpp"

#include "lower_thread_priority.hpp"

#include <exception>

namespace webots_cloud::adapters {

WorkerThreads::WorkerThreads(std::size_t threads, Priority priority)
    : priority_(priority), jobs_(threads), max_(threads)
{
    ::sem_init(&waiting_, 0, 0);
    try {
        start_another();
    } catch (...) {
        ::sem_destroy(&waiting_);
        throw;
    }
}

WorkerThreads::~WorkerThreads()
{
    stopping_ = true;
    join();
    jobs_.consume_all([](Job* job) { delete job; });
    ::sem_destroy(&waiting_);
}

void WorkerThreads::post(std::unique_ptr<Job> job)
{
    enqueue(job.release());
}

void WorkerThreads::enqueue(Job* job)
{
    jobs_.push(job);
    ::sem_post(&waiting_);
}

void WorkerThreads::start_another()
{
    std::lock_guard const lock(starting_);
    if (threads_.size() >= max_)
        return;
    ++idle_;
    try {
        threads_.emplace_back(&WorkerThreads::work, this);
    } catch (...) {
        --idle_;
        throw;
    }
}

void WorkerThreads::join()
{
    enqueue(nullptr);
    for (std::size_t joined = 0;; ++joined) {
        std::thread next;
        { // jobs that still wait may make one of the threads start another
            std::lock_guard const lock(starting_);
            if (joined == threads_.size()) {
                threads_.clear();
                return;
            }
            next = std::move(threads_[joined]);
        }
        next.join();
    }
}

void WorkerThreads::work()
{
    if (priority_ == Priority::background)
        lower_thread_priority();
    for (;;) {
        while (::sem_wait(&waiting_) != 0) { // interrupted by a signal
        }
        Job* job = nullptr;
        if (stopping_ || !jobs_.pop(job) || !job) {
            enqueue(nullptr); // for the others
            return;
        }
        // The last idle thread starts another before it is busy, so that no job waits while there may be more
        // threads.
        if (--idle_ == 0) {
            try {
                start_another();
            } catch (std::exception const&) { // no more threads for us; those that there are go on
            }
        }
        job->run(std::unique_ptr<Job>(job));
        ++idle_;
    }
}

} // namespace webots_cloud::adapters
