#include "worker_threads.hpp"

#include "step_back.hpp"

namespace webots_cloud::adapters {

WorkerThreads::WorkerThreads(std::size_t threads, Priority priority) : priority_(priority), jobs_(threads)
{
    ::sem_init(&waiting_, 0, 0);
    try {
        for (std::size_t i = 0; i < threads; ++i)
            threads_.emplace_back(&WorkerThreads::work, this);
    } catch (...) { // no more threads for us
        join();
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

void WorkerThreads::join()
{
    for (std::size_t i = 0; i < threads_.size(); ++i)
        enqueue(nullptr);
    for (auto& thread : threads_)
        thread.join();
    threads_.clear();
}

void WorkerThreads::work()
{
    if (priority_ == Priority::background)
        step_back();
    for (;;) {
        while (::sem_wait(&waiting_) != 0) { // interrupted by a signal
        }
        Job* job = nullptr;
        if (stopping_ || !jobs_.pop(job) || !job)
            return;
        job->run(std::unique_ptr<Job>(job));
    }
}

} // namespace webots_cloud::adapters
