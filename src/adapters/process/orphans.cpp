#include "orphans.hpp"

#include "adapters/files/file_descriptor.hpp"

#include <boost/asio/co_spawn.hpp>

#include <dirent.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <string>

namespace webots_cloud::adapters {

namespace asio = boost::asio;

namespace {

/// From the end of a guard to that of its output, which is the same moment where all is well.
constexpr auto patience = std::chrono::milliseconds(300);

bool writes_to(std::string const& process, ino_t pipe)
{
    for (auto const* const stream : {"/fd/1", "/fd/2"}) {
        struct stat status
        {};
        if (::stat(("/proc/" + process + stream).c_str(), &status) == 0 && S_ISFIFO(status.st_mode) &&
            status.st_ino == pipe)
            return true;
    }
    return false;
}

FileDescriptor open_process(pid_t process)
{
    return FileDescriptor(static_cast<int>(::syscall(SYS_pidfd_open, process, 0)));
}

} // namespace

void end_writers(ino_t pipe)
{
    std::unique_ptr<DIR, int (*)(DIR*)> const listing(::opendir("/proc"), &::closedir);
    while (auto const* const entry = listing ? ::readdir(listing.get()) : nullptr) {
        std::string const name = entry->d_name;
        auto const number = static_cast<pid_t>(std::atoi(name.c_str()));
        if (number <= 0 || number == ::getpid() || !writes_to(name, pipe))
            continue;
        auto const process = open_process(number);
        if (process && writes_to(name, pipe)) // still the same process
            ::syscall(SYS_pidfd_send_signal, process.get(), SIGKILL, nullptr, 0);
    }
}

Orphans::Orphans(asio::readable_pipe& output, pid_t guard, EndWriters end)
    : output_(output), guard_(output.get_executor()), timer_(output.get_executor()),
      end_writers_(std::move(end))
{
    struct stat status
    {};
    auto opened = open_process(guard);
    if (!opened || ::fstat(output.native_handle(), &status) != 0)
        return;
    pipe_ = status.st_ino;
    boost::system::error_code error;
    guard_.assign(opened.get(), error);
    if (!error)
        (void)opened.release();
}

void Orphans::watch()
{
    watches_ = true;
    if (!guard_.is_open())
        return;
    guard_.async_wait(asio::posix::descriptor_base::wait_read,
                      [self = shared_from_this()](boost::system::error_code const& error) {
                          if (!error && self->watches_)
                              self->look();
                      });
}

void Orphans::rest()
{
    watches_ = false;
    boost::system::error_code ignored;
    guard_.cancel(ignored);
    timer_.cancel();
}

/// The guard has ended.
void Orphans::look()
{
    timer_.expires_after(patience);
    timer_.async_wait([self = shared_from_this()](boost::system::error_code const& error) {
        if (error || !self->watches_)
            return;
        if (++self->looks_ > max_looks) {
            boost::system::error_code ignored;
            self->output_.cancel(ignored);
            return;
        }
        auto ending = self->end_writers_(self->pipe_);
        asio::co_spawn(self->timer_.get_executor(), std::move(ending), [self](std::exception_ptr const&) {
            if (self->watches_)
                self->look();
        });
    });
}

} // namespace webots_cloud::adapters
