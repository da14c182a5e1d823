// Programs that print and end as a script says.
#pragma once

#include <webots_cloud/testing/fuse.hpp>
#include <webots_cloud/transport/process_host.hpp>

#include <deque>
#include <set>
#include <string>
#include <vector>

namespace webots_cloud::testing {

/// A process host whose programs follow a timetable:
/// `processes.expect().prints(".\n").after(5s).prints(".\n").exits(0);`
///
/// A program that was asked to end does so at once, unless it is `stubborn()`: then the grace must pass. Each
/// program "listens" on the port that its arguments name, in the syntax of old or new releases of Webots,
/// unless the script says otherwise.
/// Lifetime: `clock` must outlive it, and it the processes it started.
class ScriptedProcesses final : public ProcessHost
{
public:
    explicit ScriptedProcesses(Clock& clock) : clock_(clock) {}

    /// What a program prints and how it ends, one thing after the other.
    class Script
    {
    public:
        Script() = default;

        Script& after(Duration delay);
        Script& prints(std::string bytes);
        Script& exits(int code);
        Script& crashes(int signal);
        /// Ignores the request to end until it is killed.
        Script& stubborn();
        /// Listens on these ports instead.
        Script& listens(std::vector<std::uint16_t> ports);
        /// Its guard says that it listens, at this point, and nobody has to look.
        Script& is_reached();
        /// Its guard never says that, although nobody has to look.
        Script& is_never_reached();
        /// Keeps this share of one processor busy all the time, in percent, and this much memory.
        Script& consumes(double cpu_percent, std::uint64_t memory_bytes);
        /// Keeps this share of one graphics processor busy all the time, in percent.
        Script& renders(double graphics_percent);
        /// Has this many processes, all the time.
        Script& starts(std::uint64_t processes);
        /// The kernel kills one of its processes at the limit of memory.
        Script& loses_a_process_for_memory();

    private:
        friend ScriptedProcesses;
        friend class ScriptedProcess;

        struct Step
        {
            Duration delay{};
            ProcessEvent event;
        };

        std::deque<Step> steps_;
        Duration delay_{};
        bool stubborn_ = false;
        bool has_ports_ = false;
        bool is_reported_ = false;
        std::vector<std::uint16_t> ports_;
        double cpu_percent_ = 0;
        std::uint64_t memory_bytes_ = 0;
        double graphics_percent_ = 0;
        std::uint64_t processes_ = 1;
        std::uint64_t memory_kills_ = 0;
    };

    /// The script of the next program that is started. Without one a start fails.
    Script& expect() { return scripts_.emplace_back(); }

    boost::asio::awaitable<result<std::unique_ptr<Process>>> start(ProcessSpec spec) override;
    result<std::unique_ptr<PortHold>> hold_port(std::uint16_t port) override;

    /// What was started, in order.
    std::vector<ProcessSpec> const& started() const noexcept { return started_; }

    /// Programs whose end was not read, and ports that are held: both should be 0 at the end of a test.
    int alive() const noexcept { return alive_; }
    std::size_t held() const noexcept { return held_.size(); }

    /// When somebody looked for the port of a program.
    std::vector<TimePoint> const& looks() const noexcept { return looks_; }

    std::set<std::uint16_t> taken; ///< Ports that other programs use.
    Fuse fuse;

private:
    friend class ScriptedProcess;
    friend class ScriptedHold;

    Clock& clock_;
    std::deque<Script> scripts_;
    std::vector<ProcessSpec> started_;
    std::set<std::uint16_t> held_;
    std::vector<TimePoint> looks_;
    int alive_ = 0;
};

} // namespace webots_cloud::testing
