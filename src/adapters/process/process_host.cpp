// Starts each program under a guard (src/guard), which is told by a byte, or by the end of our socket, to end
// the whole tree; so a process that we have lost sight of can't outlive us. Whatever may block (starting,
// measuring, looking for ports) runs on other threads, and events arrive here. Why so:
// docs/decisions/005-guard.md and 009-boost-process.md.
#include "adapters/files/file_descriptor.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "async/cancellation.hpp"
#include "control_groups.hpp"
#include "core/text.hpp"
#include "guard_command.hpp"
#include "held_port.hpp"
#include "orphans.hpp"
#include "process_inspection.hpp"
#include "spawn.hpp"

#include <webots_cloud/adapters/processes.hpp>

#include <boost/asio/as_tuple.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/connect_pipe.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/posix/stream_descriptor.hpp>
#include <boost/asio/readable_pipe.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/asio/writable_pipe.hpp>
#include <boost/process/v2/process.hpp>

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace process = boost::process::v2;
using core::concat;

constexpr std::size_t read_size = 16 * 1024; // of output, at once

constexpr std::size_t default_max_processes = 256; // to look at

constexpr auto wake_interval = std::chrono::milliseconds(250); // of WakeCalls

/// Repeatedly wakes (SIGCONT) a guard that was told to end: while somebody has it stopped (SIGSTOP), it would
/// never read its standard input. A running guard is not affected.
class WakeCalls : public std::enable_shared_from_this<WakeCalls>
{
public:
    WakeCalls(asio::any_io_executor const& executor, pid_t guard) : timer_(executor), guard_(guard) {}

    void start()
    {
        if (over_)
            return;
        ::kill(guard_, SIGCONT);
        timer_.expires_after(wake_interval);
        timer_.async_wait([self = shared_from_this()](boost::system::error_code const& error) {
            if (!error)
                self->start();
        });
    }

    /// Once the guard has ended.
    void stop()
    {
        over_ = true;
        timer_.cancel();
    }

private:
    asio::steady_timer timer_;
    pid_t guard_;
    bool over_ = false;
};

/// Waits for a guard whose owner has been destroyed, so that it leaves no zombie.
asio::awaitable<void> await_end(process::process guard, std::shared_ptr<WakeCalls> wake_calls,
                                std::shared_ptr<adapters::OwnGroup const>)
{
    (void)co_await guard.async_wait(asio::as_tuple(asio::use_awaitable));
    wake_calls->stop();
}

asio::awaitable<ProcessUsage> known_usage(ProcessUsage usage)
{
    co_return usage;
}

/// Our end of the control socket, on which the guard says one thing: that the port of the program is reached.
class GuardReport : public std::enable_shared_from_this<GuardReport>
{
public:
    /// Nobody hears it where no watch (epoll) is left for `control`: then `is_heard` is false. Lifetime:
    /// `output` must outlive `close`.
    GuardReport(asio::readable_pipe& output, int control) : output_(output), control_(output.get_executor())
    {
        adapters::FileDescriptor copy(::fcntl(control, F_DUPFD_CLOEXEC, 0));
        boost::system::error_code error;
        control_.assign(copy.get(), error);
        is_heard_ = !error;
        if (is_heard_)
            (void)copy.release();
    }

    /// While somebody reads the output: that is cancelled when the report comes.
    void watch()
    {
        watches_ = true;
        if (!control_.is_open())
            return;
        control_.async_wait(asio::posix::descriptor_base::wait_read,
                            [self = shared_from_this()](boost::system::error_code const& error) {
                                if (!error && self->control_.is_open())
                                    self->read();
                            });
    }

    void rest()
    {
        watches_ = false;
        boost::system::error_code ignored;
        control_.cancel(ignored);
    }

    void close()
    {
        boost::system::error_code ignored;
        control_.close(ignored);
    }

    bool is_heard() const noexcept { return is_heard_; }
    bool has_come() const noexcept { return has_come_; }

    /// Whether it has come, and was not taken yet.
    bool take() noexcept { return has_come_ && !std::exchange(is_taken_, true); }

private:
    void read()
    {
        char byte = 0;
        has_come_ = ::recv(control_.native_handle(), &byte, 1, MSG_DONTWAIT) == 1;
        close(); // also when the guard has ended
        boost::system::error_code ignored;
        if (has_come_ && watches_)
            output_.cancel(ignored);
    }

    asio::readable_pipe& output_;
    asio::posix::stream_descriptor control_;
    bool is_heard_ = false;
    bool watches_ = false;
    bool has_come_ = false;
    bool is_taken_ = false;
};

/// A program below its guard, which is all that we see of it besides the output.
class GuardedProcess final : public Process
{
public:
    GuardedProcess(process::process guard, adapters::FileDescriptor control, asio::readable_pipe output,
                   std::shared_ptr<adapters::InspectionThreads> inspection, ProcessSpec const& spec,
                   std::shared_ptr<adapters::OwnGroup const> group,
                   std::shared_ptr<GraphicsTimes const> graphics)
        : guard_(std::move(guard)), control_(std::move(control)), output_(std::move(output)),
          inspection_(std::move(inspection)), relayed_port_(port_of(spec.network)),
          broker_(spec.network.broker.native()), group_(std::move(group)), graphics_(std::move(graphics)),
          limits_(spec.limits), wake_calls_(std::make_shared<WakeCalls>(output_.get_executor(), guard_.id())),
          orphans_(
              std::make_shared<adapters::Orphans>(output_, guard_.id(), [threads = inspection_](ino_t pipe) {
                  return adapters::end_writers_aside(threads, pipe);
              }))
    {
        if (!reports_port(spec))
            return;
        auto report = std::make_shared<GuardReport>(output_, control_.get());
        if (report->is_heard())
            report_ = std::move(report);
    }

    ~GuardedProcess() override
    {
        orphans_->rest();
        if (report_)
            report_->close();
        if (!status_) {
            auto const executor = output_.get_executor();
            control_ = adapters::FileDescriptor(); // end-of-file: the guard kills the tree at once
            wake_calls_->start();
            asio::co_spawn(executor, await_end(std::move(guard_), wake_calls_, std::move(group_)),
                           asio::detached);
        }
    }

    int id() const noexcept override { return guard_.id(); }
    asio::awaitable<result<ProcessEvent>> next_event() override;
    void terminate() noexcept override;
    Listening listening() const noexcept override
    {
        if (!report_)
            return Listening::unknown;
        return report_->has_come() ? Listening::yes : Listening::no;
    }
    asio::awaitable<std::uint16_t> listening_port(std::uint16_t first, std::uint16_t last) override
    {
        adapters::FindPort work{guard_.id(), first, last, relayed_port_, broker_};
        return adapters::find_port(inspection_, std::move(work));
    }
    asio::awaitable<ProcessUsage> usage() override
    {
        return status_ ? known_usage(refusals_) : adapters::take_usage(inspection_, usage_to_take());
    }

private:
    static std::uint16_t port_of(ProcessNetwork const& network)
    {
        return network.reach == ProcessNetwork::Reach::host ? std::uint16_t{0} : network.port;
    }

    /// Whether our own guard relays the port, and the relay is not the container's.
    static bool reports_port(ProcessSpec const& spec)
    {
        return port_of(spec.network) != 0 && spec.container.docker.empty() && spec.remote.command.empty();
    }

    adapters::TakeUsage usage_to_take() const;

    process::process guard_;
    adapters::FileDescriptor control_;
    asio::readable_pipe output_;
    std::shared_ptr<adapters::InspectionThreads> inspection_;
    std::uint16_t relayed_port_;
    std::string broker_;
    std::shared_ptr<adapters::OwnGroup const> group_; ///< Null: it has none.
    std::shared_ptr<GraphicsTimes const> graphics_;
    ProcessLimits limits_;
    ProcessUsage refusals_; ///< Once it has ended.
    std::shared_ptr<WakeCalls> wake_calls_;
    std::shared_ptr<adapters::Orphans> orphans_;
    std::shared_ptr<GuardReport> report_; ///< Null: nobody says when the port is reached.
    std::array<char, read_size> buffer_;
    std::optional<ExitStatus> status_;
};

adapters::TakeUsage GuardedProcess::usage_to_take() const
{
    adapters::TakeUsage work;
    work.root = guard_.id();
    // Lest more processes be overlooked than there may be.
    work.max_processes = std::max(default_max_processes, static_cast<std::size_t>(limits_.processes) + 1);
    bool const is_ours_to_keep = limits_.memory > 0 && (!group_ || group_->group.memory == 0);
    work.enough_memory = is_ours_to_keep ? limits_.memory : ~std::uint64_t{0};
    work.has_limits = limits_.any();
    work.group = group_;
    work.graphics = graphics_;
    return work;
}

asio::awaitable<result<ProcessEvent>> GuardedProcess::next_event()
{
    if (status_)
        co_return ProcessEvent(*status_);
    if (report_ && report_->take())
        co_return ProcessEvent(ProcessListens());
    // The output first, to its end, and only then the status: a program's last words come before its end.
    if (output_.is_open()) {
        orphans_->watch();
        if (report_)
            report_->watch();
        auto const [error, size] =
            co_await output_.async_read_some(asio::buffer(buffer_), asio::as_tuple(asio::use_awaitable));
        orphans_->rest();
        if (report_)
            report_->rest();
        // Three have reason to cancel the read: the report of the guard, `orphans_`, and the caller. Only
        // what is left is the caller's.
        if (error == asio::error::operation_aborted && report_ && report_->take())
            co_return ProcessEvent(ProcessListens());
        if (error == asio::error::operation_aborted && !orphans_->are_out_of_reach())
            co_return Failure(error);
        if (!error)
            co_return ProcessEvent(ProcessOutput(std::string(buffer_.data(), size)));
        // The guard keeps the other end open until no process of the tree is left: the end of the output
        // means that all have ended.
        boost::system::error_code ignored;
        output_.close(ignored);
    }
    auto const [error, native] = co_await guard_.async_wait(asio::as_tuple(asio::use_awaitable));
    if (error == asio::error::operation_aborted)
        co_return Failure(error);
    wake_calls_->stop();
    if (group_) { // not cancellable: the end is reported with its reason
        adapters::TakeRefusals work{std::exchange(group_, nullptr)};
        refusals_ = co_await async::uncancellable(inspection_->limits.run(std::move(work)));
    }
    int const status = guard_.native_exit_code();
    status_ =
        WIFSIGNALED(status) ? ExitStatus(WTERMSIG(status), true) : ExitStatus(WEXITSTATUS(status), false);
    co_return ProcessEvent(*status_);
}

void GuardedProcess::terminate() noexcept
{
    if (status_)
        return;
    ::send(control_.get(), "T", 1,
           MSG_NOSIGNAL | MSG_DONTWAIT); // a full socket already has such bytes in it
    wake_calls_->start();
}

/// Why a process can't be spoken with.
Failure no_pipe(boost::system::error_code error)
{
    if (error == boost::system::errc::no_space_on_device)
        return {errc::start_failed,
                "other programs of the server's user have all watches (epoll) that the kernel gives it"};
    return {errc::start_failed, concat("no pipe: ", error.message())};
}

/// The process as one whose end the event loop hears of.
result<process::process> watched(asio::any_io_executor const& executor, pid_t id)
{
    adapters::FileDescriptor handle(static_cast<int>(::syscall(SYS_pidfd_open, id, 0)));
    try {
        process::process made(executor, id, handle.get());
        (void)handle.release();
        return made;
    } catch (boost::system::system_error const& failure) {
        return no_pipe(failure.code());
    }
}

/// Waits for the end of a process.
struct Reap
{
    bool operator()() const
    {
        while (::waitpid(id, nullptr, 0) < 0 && errno == EINTR)
            continue;
        return true;
    }

    pid_t id = -1;
};

/// Starts programs on this machine, each below a guard.
class LocalProcessHost final : public ProcessHost
{
public:
    LocalProcessHost(asio::any_io_executor executor, std::filesystem::path guard,
                     std::vector<std::filesystem::path> read_only, std::shared_ptr<ControlGroups> groups,
                     std::shared_ptr<GraphicsTimes const> graphics)
        : executor_(std::move(executor)), guard_(std::move(guard)), read_only_(std::move(read_only)),
          groups_(std::move(groups)), graphics_(std::move(graphics))
    {}

    asio::awaitable<result<std::unique_ptr<Process>>> start(ProcessSpec spec) override;
    result<std::unique_ptr<PortHold>> hold_port(std::uint16_t port) override
    {
        return adapters::hold_port(port);
    }

private:
    asio::any_io_executor executor_;
    std::filesystem::path guard_;
    std::vector<std::filesystem::path> read_only_;
    std::shared_ptr<ControlGroups> groups_;
    std::shared_ptr<GraphicsTimes const> graphics_;
    adapters::BlockingPool pool_{1};
    std::shared_ptr<adapters::InspectionThreads> inspection_ =
        std::make_shared<adapters::InspectionThreads>();
};

/// Makes the groups of one program.
struct MakeGroup
{
    result<ControlGroups::Group> operator()() const { return groups->make(limits); }

    std::shared_ptr<ControlGroups> groups;
    ProcessLimits limits;
};

asio::awaitable<result<std::unique_ptr<Process>>> LocalProcessHost::start(ProcessSpec spec)
{
    if (spec.argv.empty())
        co_return Failure(errc::invalid_argument, "argv: wanted a program and its arguments");
    // What the guard can't execute would be known by its exit status alone: so it is said before.
    for (auto const& program : {guard_.string(), spec.argv.front()})
        if (::access(program.c_str(), X_OK) != 0)
            co_return Failure(errc::start_failed,
                              concat(program, " can't be run: ",
                                     std::error_code(errno, std::generic_category()).message()));

    boost::system::error_code error;
    auto const here = std::filesystem::current_path(error); // the guard starts in the folder of the process
    spec.argv.front() = (here / spec.argv.front()).string();
    std::shared_ptr<adapters::OwnGroup const> group;
    if (groups_ && spec.limits.any() && spec.remote.command.empty()) {
        MakeGroup work{groups_, spec.limits};
        auto made = co_await pool_.run(std::move(work));
        if (!made)
            co_return made.error();
        if (!made->folders.empty())
            group = std::make_shared<adapters::OwnGroup const>(groups_, std::move(*made));
    }

    asio::readable_pipe output(executor_);
    asio::writable_pipe output_end(executor_);
    // A socket, since the end of a pipe can be opened again through /proc, also by the simulation, and then
    // our death would not be the end-of-file for the guard.
    int ends[2] = {-1, -1};
    asio::connect_pipe(output, output_end, error);
    if (!error && ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
        error.assign(errno, boost::system::system_category());
    if (error)
        co_return no_pipe(error);
    adapters::FileDescriptor control(ends[0]);
    adapters::FileDescriptor const control_end(ends[1]);

    bool const begins_here = spec.directory.empty() || !spec.remote.copied.empty();
    auto const directory = begins_here ? here : spec.directory;
    adapters::Spawn spawn;
    spawn.program = (here / guard_).string();
    std::vector<std::string> read_only;
    for (auto const& folder : read_only_)
        read_only.push_back((here / folder).string());
    spawn.arguments =
        adapters::guard_arguments(spec, spawn.program, read_only, group ? &group->group : nullptr);
    for (auto const& [name, value] : spec.environment)
        spawn.environment.push_back(concat(name, "=", value));
    spawn.directory = directory.string();
    spawn.input = control_end.get();
    spawn.output = output_end.native_handle();
    spawn.users = spec.user ? spec.user->user_namespace : -1;
    auto const [failure, id] = co_await pool_.run(std::move(spawn));
    if (failure != 0)
        co_return Failure(errc::start_failed,
                          concat(spec.argv.front(), " can't be started: ",
                                 std::error_code(failure, std::generic_category()).message()));
    auto guard = watched(executor_, id);
    if (!guard) {
        control = adapters::FileDescriptor(); // end-of-file: it ends
        Reap reap{id};
        co_await pool_.run(std::move(reap));
        co_return guard.error();
    }
    // `output_end` and `control_end` are closed with this frame. Then only the guard has them, and the end of
    // the output is the end of the tree.
    co_return std::make_unique<GuardedProcess>(std::move(*guard), std::move(control), std::move(output),
                                               inspection_, spec, std::move(group), graphics_);
}

} // namespace

std::unique_ptr<ProcessHost> make_process_host(asio::any_io_executor executor, std::filesystem::path guard,
                                               std::vector<std::filesystem::path> read_only,
                                               std::shared_ptr<ControlGroups> groups,
                                               std::shared_ptr<GraphicsTimes const> graphics)
{
    return std::make_unique<LocalProcessHost>(std::move(executor), std::move(guard), std::move(read_only),
                                              std::move(groups), std::move(graphics));
}

} // namespace webots_cloud
