// Work for a thread whose outcome comes back to the event loop.
#pragma once

#include "mailbox.hpp"
#include "worker_threads.hpp"

#include <boost/asio/any_io_executor.hpp>

#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

namespace webots_cloud::adapters {

/// Made and destroyed on the event loop, so that no thread need free what another allocated.
template<class Work, class Done>
class Errand final : public WorkerThreads::Job, public Mailbox::Letter
{
public:
    Errand(Mailbox& mailbox, Work work, Done done)
        : mailbox_(mailbox), work_(std::move(work)), done_(std::move(done))
    {}

    void run(std::unique_ptr<Job> self) override
    {
        outcome_.emplace(work_());
        (void)self.release();
        mailbox_.deliver(std::unique_ptr<Letter>(this));
    }

    void open() override { done_(std::move(*outcome_)); }

private:
    Mailbox& mailbox_;
    Work work_;
    Done done_;
    std::optional<std::invoke_result_t<Work&>> outcome_;
};

/// Has `work` done on one of the threads, and then `done` called with what it returned, on the event loop of
/// `home`, which does not run dry before. Neither may throw.   Thread: that of the event loop.
template<class Work, class Done>
void send_on_errand(WorkerThreads& threads, boost::asio::any_io_executor const& home, Work work, Done done)
{
    auto& mailbox = Mailbox::of(home);
    auto errand = std::make_unique<Errand<Work, Done>>(mailbox, std::move(work), std::move(done));
    mailbox.expect();
    threads.post(std::move(errand));
}

} // namespace webots_cloud::adapters
