// Child processes as a seam: where simulators run, and how whole process trees end.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/process_limits.hpp>
#include <webots_cloud/transport/clock.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What the processes of a tree reach of the network.
struct ProcessNetwork
{
    ProcessNetwork() = default;

    enum class Reach
    {
        host,     ///< Everything: they share the network of the machine.
        none,     ///< Nothing but each other.
        internet, ///< What slirp4netns passes on and `rules` do not forbid.
    };

    Reach reach = Reach::host;
    /// With a network of their own: connections to this port of the machine, on all of its IPv4 addresses,
    /// reach the same port in there, once somebody listens on it. 0: none do.
    std::uint16_t port = 0;
    /// Not empty, with a network of their own: that port of the machine stays closed. Instead there is a Unix
    /// socket of this name, from the time when somebody in there listens on `port`, that answers each
    /// connection with a socket connected to it (SCM_RIGHTS). Only we may enter its folder; absolute.
    std::filesystem::path broker;
    std::filesystem::path slirp; ///< `slirp4netns`, absolute; for `internet`.
    std::filesystem::path ip;    ///< `ip` of iproute2, absolute; for `internet`.
    std::filesystem::path rules; ///< A file of lines for `ip -batch`, carried out in there; for `internet`.
};

/// Another user than ours, who runs a program. Only root can start one, or the owner of a user
/// namespace.
struct ProcessUser
{
    ProcessUser() = default;

    /// Not -1: the descriptor of a user namespace in which we are root, and all numbers are meant. When the
    /// program has ended, the folders in `folder` are ours again.
    int user_namespace = -1;
    std::uint32_t user = 0;
    std::uint32_t group = 0;
    std::vector<std::uint32_t> groups; ///< Further ones.
    /// Becomes the user's with everything in it. Empty: nothing changes hands, and no home is made.
    std::filesystem::path folder;
    std::filesystem::path home;                 ///< Is made in `folder`.
    std::filesystem::path x_authority;          ///< Is copied to `<home>/Xauthority`; empty: there is none.
    std::vector<std::filesystem::path> visible; ///< What it has to reach, even below folders of root's.
};

/// How a program is started on another machine, which has our programs and folders at the same places.
struct RemoteStart
{
    RemoteStart() = default;

    /// Absolute, with arguments (`srun`). Continued by the command line of a guard, which it starts there,
    /// whose output it passes on and whose exit status is its own; SIGTERM and its end reach that guard.
    /// Empty: the program runs here.
    std::vector<std::string> command;
    /// The guard there prints a line that says where it is, and another one when the program listens on one
    /// of these TCP ports, both for SimulationLauncher to read; `Process::listening_port` can't see that.
    std::uint16_t first_port = 0;
    std::uint16_t last_port = 0;
    /// Our files and folders, absolute, that are copied there before the program starts: `/a/b` is
    /// `<copied_to>/a/b` there. `copied_to` is made, and removed when the program has ended; what stands
    /// before the first dot of its name tells folders of this kind from others beside it. `directory` of the
    /// program is there as well. Empty: our folders can be seen from there.
    std::vector<std::filesystem::path> copied;
    std::filesystem::path copied_to;
};

/// A container that compose starts.
struct ComposeContainer
{
    ComposeContainer() = default;

    std::filesystem::path docker; ///< The program, absolute. Empty: there is no such container.
    std::string label;            ///< `<key>=<value>`, which no other container has.
};

/// A program to run. Nothing is ever passed through a shell.
struct ProcessSpec
{
    ProcessSpec() = default;

    /// argv[0] is the path of the program; a relative one starts at the host's own folder. Where it is a
    /// wrapper, such as that of a sandbox, nobody looks whether what it wraps is there.
    std::vector<std::string> argv;
    /// The whole environment of the process; nothing else is inherited.
    std::vector<std::pair<std::string, std::string>> environment;
    std::filesystem::path directory; ///< Working directory; empty: the host's own.
    /// From the request to end (SIGTERM) until the whole tree is killed. Default 1.5 s: no browser is
    /// watching any more.
    Duration grace = std::chrono::milliseconds(1500);
    /// A cleanup command that is run when no process of the tree is left, for whatever reason, even when we
    /// have died: it removes what the tree has left elsewhere. Only when it has ended too, or was killed
    /// after a minute, has the process ended. Default: none.
    std::vector<std::string> cleanup_command;
    /// Whether programs that run as another user (set-user-ID, `sudo`, `firejail`) must work in the tree.
    /// They do not work where an unprivileged user isolates it; with this, the tree is isolated less.
    /// Default: no.
    bool set_user_id = false;
    /// Not empty: the program makes a sandbox with a PID namespace itself, with privileges of its own, and
    /// keeps its files in this folder, which is empty and in memory for it (firejail). Only root can start
    /// such a program. Default: empty.
    std::filesystem::path own_sandbox;
    /// Whether X servers of the tree and those of the machine are hidden from each other. Where that can't be
    /// done, the program is not started and says so. Default: no.
    bool own_displays = false;
    /// The program gets these files open for reading, with consecutive descriptors from `first_opened` on. In
    /// place of one that can't be opened it gets an empty file. Default: none.
    std::vector<std::filesystem::path> opened;
    static constexpr int first_opened = 10;
    /// The program is compose, and the network that of this container, which must have none of Docker's. Only
    /// root can start it. Default: there is none.
    ComposeContainer container;
    RemoteStart remote; ///< Everything else but `cleanup_command` holds there. Default: it runs here.
    std::optional<ProcessUser> user; ///< Default: our own. The cleanup command is ours in any case.
    ProcessNetwork network;          ///< Where that can't be made, the program is not started and says so.
    /// Kept as well as the host can: see `Process::usage` for what it can't. Where it can, but a limit can't
    /// be set for this program, it is not started. That of `disk` is each file's.
    ProcessLimits limits;
};

/// How a program ended.
struct ExitStatus
{
    ExitStatus() = default;
    ExitStatus(int code, bool signalled) : code(code), signalled(signalled) {}

    int code = 0; ///< Exit status, or the number of the signal.
    bool signalled = false;

    bool operator==(ExitStatus const&) const = default;
};

/// A piece of the program's standard output and error: any length, any encoding.
struct ProcessOutput
{
    ProcessOutput() = default;
    explicit ProcessOutput(std::string bytes) : bytes(std::move(bytes)) {}

    std::string bytes;
};

/// What a program and everything it started have consumed.
struct ProcessUsage
{
    ProcessUsage() = default;
    ProcessUsage(Duration processor, std::uint64_t memory_bytes)
        : processor(processor), memory_bytes(memory_bytes)
    {}

    Duration processor{}; ///< Time of all processors, of processes that have ended too.
    /// In memory now. Without control groups, pages that processes share count once for each.
    std::uint64_t memory_bytes = 0;
    /// What counts towards the limit of memory: what no file is behind, also in swap, with the tables of the
    /// kernel for it. Where that could be over the limit, also files in memory and shared memory.
    std::uint64_t own_memory_bytes = 0;
    Duration graphics{};              ///< Time of all graphics processors: `GraphicsTimes::busy`.
    std::uint64_t processes = 0;      ///< And threads.
    std::uint64_t memory_kills = 0;   ///< Processes that the kernel has killed at the limit of memory.
    std::uint64_t refused_forks = 0;  ///< Processes that it has not started at their limit.
    bool complete = true;             ///< False: there are more processes than were sampled.
    std::optional<TimePoint> counted; ///< When that was so; none: now.

    bool operator==(ProcessUsage const&) const = default;
};

/// The program listens now: see `Process::listening`.
struct ProcessListens
{
    ProcessListens() = default;
};

using ProcessEvent = std::variant<ProcessOutput, ExitStatus, ProcessListens>;

/// What is known of the port of a tree with a network of its own, `ProcessNetwork::port`.
enum class Listening
{
    unknown, ///< Nobody says when that changes: `Process::listening_port` finds it.
    no,      ///< Nothing accepts connections yet.
    yes      ///< From now on whoever connects from outside reaches it.
};

/// A running program and everything it started.
///
/// The destructor ends the whole tree at once, without waiting for it.
/// Lifetime: must outlive its operations, but for those that say otherwise: await their end before it is
/// destroyed.
/// Thread-safety: one executor.
class Process
{
public:
    virtual ~Process() = default;

    /// The number of the process, for logs.
    virtual int id() const noexcept = 0;

    /// The next output, once that the program listens (if `listening` was `no`), or finally how the program
    /// ended: then no process of its tree is alive. Further calls return the same.
    ///
    /// Cancellation: terminal; an event that arrives at that very moment may be lost, the end never is, nor
    /// what `listening` says.
    virtual boost::asio::awaitable<result<ProcessEvent>> next_event() = 0;

    /// Asks the tree to end: SIGTERM now, SIGKILL after the grace. Returns at once; the exit is an event as
    /// usual.
    virtual void terminate() noexcept = 0;

    /// Whether the program listens, as far as that is told without being asked for. The program could claim
    /// no more than that.
    virtual Listening listening() const noexcept { return Listening::unknown; }

    /// The lowest TCP port from `first` to `last` that some process of the tree listens on; 0: none. Only the
    /// processes that are nearest to the root are looked at, in bounded number. Of a tree with a network of
    /// its own only the port of that is known.
    virtual boost::asio::awaitable<std::uint16_t> listening_port(std::uint16_t first, std::uint16_t last) = 0;

    /// What the tree has consumed until now; once it is gone, what the kernel has refused it. The process may
    /// be destroyed meanwhile.
    virtual boost::asio::awaitable<ProcessUsage> usage() = 0;
};

/// Reserves a TCP port until destroyed: no other program can bind it meanwhile, and connections are refused.
class PortHold
{
public:
    virtual ~PortHold() = default;
};

/// A place where programs run.
class ProcessHost
{
public:
    virtual ~ProcessHost() = default;

    /// Starts a program.
    ///
    /// Errors: `start_failed`, its detail naming the program and the reason, which the SimulationLauncher
    /// tells as `Unable to start Webots: <detail>`; a failure with an `info()` is told as it is;
    /// `invalid_argument`: `argv` is empty.
    virtual boost::asio::awaitable<result<std::unique_ptr<Process>>> start(ProcessSpec spec) = 0;

    /// Takes a free port.
    /// Errors: `unavailable` when another program uses it.
    virtual result<std::unique_ptr<PortHold>> hold_port(std::uint16_t port) = 0;
};

} // namespace webots_cloud
