// Runs the guard for each thing that only root of the simulations' user namespace can do: making it,
// measuring, giving and taking folders. Decision 013 says why; src/guard/subordinate.cpp and folders.cpp are
// the other side.
#include "subordinate_users.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "core/text.hpp"
#include "spawn.hpp"

#include <fcntl.h>
#include <linux/nsfs.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

constexpr auto start_limit = std::chrono::seconds(15); // of a machine that has much to do
constexpr auto run_limit = std::chrono::minutes(1);
constexpr std::size_t max_output = 4096;         // what follows is read and forgotten
constexpr std::uint32_t pinned_users = 0x1'0000; // as guard/subordinate.cpp makes them

Failure system_failure(std::string_view what)
{
    return {errc::start_failed,
            concat(what, ": ", std::error_code(errno, std::generic_category()).message())};
}

/// One run of the guard, for one thing. What it prints, if it succeeds.
struct GuardRun
{
    result<std::string> operator()() const
    {
        int ends[2];
        if (::pipe2(ends, O_CLOEXEC) != 0)
            return system_failure("no pipe");
        FileDescriptor const output(ends[0]);
        FileDescriptor output_end(ends[1]);
        FileDescriptor const nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
        Spawn spawn;
        spawn.program = guard.native();
        spawn.arguments = arguments;
        spawn.input = input >= 0 ? input : nothing.get();
        spawn.output = output_end.get();
        spawn.users = users;
        auto const [failure, process] = spawn();
        errno = failure;
        if (failure != 0)
            return system_failure(concat(guard.native(), " can't be started"));
        // Else our own end would keep the output open when the guard's is closed.
        output_end = FileDescriptor();
        auto const end = await_end(process, output.get(), max_output, limit);
        if (!end.in_time)
            return Failure(errc::timed_out, concat(arguments.front(), " takes too long"));
        auto text = std::string(core::trim(end.output));
        if (end.status != 0)
            return Failure(errc::start_failed, text.empty() ? "the guard has failed" : core::printable(text));
        return text;
    }

    fs::path guard;
    std::vector<std::string> arguments;
    int users = -1; ///< A user namespace; -1: none.
    int input = -1; ///< -1: nothing.
    std::chrono::milliseconds limit = run_limit;
};

FileDescriptor receive_descriptor(int socket)
{
    char byte = 0;
    iovec data{&byte, 1};
    int received = -1;
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof received)> control{};
    msghdr message{};
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    if (::recvmsg(socket, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC) != 1)
        return FileDescriptor();
    auto const* const header = CMSG_FIRSTHDR(&message);
    if (header && header->cmsg_level == SOL_SOCKET && header->cmsg_type == SCM_RIGHTS &&
        header->cmsg_len == CMSG_LEN(sizeof received))
        std::memcpy(&received, CMSG_DATA(header), sizeof received);
    return FileDescriptor(received);
}

/// Has the guard make the user namespace; its descriptor comes over a socket.
struct MakeNamespace
{
    result<std::shared_ptr<FileDescriptor const>> operator()() const
    {
        int ends[2];
        if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
            return system_failure("no socket");
        FileDescriptor const ours(ends[0]);
        FileDescriptor const theirs(ends[1]);
        GuardRun run;
        run.guard = guard;
        run.arguments = {"--make-users",
                         range.newuidmap.native(),
                         range.newgidmap.native(),
                         std::to_string(range.first_user),
                         std::to_string(range.first_group),
                         std::to_string(range.count)};
        run.input = theirs.get();
        run.limit = start_limit;
        if (auto const made = run(); !made)
            return made.error();
        auto received = receive_descriptor(ours.get());
        if (!received)
            return Failure(errc::start_failed, "the guard has sent no user namespace");
        return std::make_shared<FileDescriptor const>(std::move(received));
    }

    fs::path guard;
    SubordinateRange range;
};

/// The users of one namespace. What only root of that may do is done by a guard that runs for it alone.
class GuardsUsers final : public SubordinateUsers
{
public:
    GuardsUsers(fs::path guard, std::shared_ptr<FileDescriptor const> opened, std::uint32_t count)
        : guard_(std::move(guard)), namespace_(std::move(opened)), count_(count)
    {}

    int user_namespace() const noexcept override { return namespace_->get(); }
    std::uint32_t count() const noexcept override { return count_; }

    asio::awaitable<result<>> take_back(fs::path folder) override
    {
        auto work = inside({"--take-back", folder.native()});
        auto const done = co_await pool_.run(std::move(work));
        if (!done)
            co_return Failure(errc::unavailable, done.error().message());
        co_return result<>();
    }

    asio::awaitable<result<>> put(fs::path from, fs::path to, std::string file) override
    {
        auto work = inside({"--put", from.native(), to.native(), std::move(file)});
        auto const done = co_await pool_.run(std::move(work));
        if (!done)
            co_return Failure(errc::unavailable, done.error().message());
        co_return result<>();
    }

    asio::awaitable<FolderUse> measure(fs::path folder, std::uint64_t enough) override
    {
        auto work = inside({"--measure", folder.native(), std::to_string(enough)});
        auto const done = co_await measuring_.run(std::move(work));
        FolderUse use;
        unsigned long long bytes = 0;
        unsigned long long free = 0;
        int too_many = 0;
        // The next measurement makes up for one that fails.
        if (done && std::sscanf(done->c_str(), "%llu %d %llu", &bytes, &too_many, &free) == 3) {
            use.bytes = bytes;
            use.too_many_files = too_many != 0;
            use.free_bytes = free;
        }
        co_return use;
    }

private:
    GuardRun inside(std::vector<std::string> arguments) const
    {
        GuardRun run;
        run.guard = guard_;
        run.arguments = std::move(arguments);
        run.arguments.insert(run.arguments.begin(), "--subordinate");
        run.users = namespace_->get();
        return run;
    }

    fs::path guard_;
    std::shared_ptr<FileDescriptor const> namespace_;
    std::uint32_t count_;
    BlockingPool pool_{1};
    BlockingPool measuring_{1};
};

} // namespace

asio::awaitable<result<std::shared_ptr<SubordinateUsers>>> make_subordinate_users(fs::path guard,
                                                                                  SubordinateRange range)
{
    BlockingPool pool(1);
    MakeNamespace work{guard, std::move(range)};
    auto const count = work.range.count;
    auto made = co_await pool.run(std::move(work));
    if (!made)
        co_return made.error();
    co_return std::make_shared<GuardsUsers>(std::move(guard), std::move(*made), count);
}

result<std::shared_ptr<SubordinateUsers>> open_pinned_users(fs::path guard, fs::path const& file)
{
    FileDescriptor opened(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOFOLLOW | O_CLOEXEC));
    if (!opened && errno == ENOENT)
        return Failure(errc::not_found, file.string());
    if (!opened)
        return system_failure(file.native());
    if (::ioctl(opened.get(), NS_GET_NSTYPE) != CLONE_NEWUSER)
        return Failure(errc::start_failed, concat(file.string(), " is no user namespace"));
    auto const shared = std::make_shared<FileDescriptor const>(std::move(opened));
    return std::make_shared<GuardsUsers>(std::move(guard), shared, pinned_users);
}

} // namespace webots_cloud::adapters
