// Memory that processes hold beyond their own pages, of real children that hide some; and that it counts.
#include "unit_test.hpp"

#include "adapters/process/process_tree.hpp"
#include "adapters/process/process_usage.hpp"
#include "adapters/process/shared_memory.hpp"

#include <fcntl.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/mount.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

using namespace webots_cloud;
using adapters::SharedMemory;

BOOST_AUTO_TEST_SUITE(shared_memory)

namespace {

constexpr std::size_t held_bytes = std::size_t{8} << 20;
constexpr std::size_t tolerance = std::size_t{1} << 20;
constexpr uid_t nobody = 65534;

int report = -1; // of a child: where it says that it has done its part

using Ends = std::array<int, 2>;

Ends make_pipe()
{
    Ends ends{};
    BOOST_TEST_REQUIRE(::pipe2(ends.data(), O_CLOEXEC) == 0);
    return ends;
}

/// A child that has done something, and stays until the end of the test.
class Child
{
public:
    /// `act` returns false where the machine does not let it.
    explicit Child(std::function<bool()> const& act)
    {
        auto const [read_end, write_end] = make_pipe();
        id_ = ::fork();
        if (id_ == 0) {
            ::setpgid(0, 0);
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            report = write_end;
            char const word = act() ? 'y' : 'n';
            (void)!::write(write_end, &word, 1);
            for (;;)
                ::pause();
        }
        ::close(write_end);
        char word = 0;
        works_ = ::read(read_end, &word, 1) == 1 && word == 'y';
        ::close(read_end);
    }
    Child(Child const&) = delete;
    ~Child()
    {
        ::kill(-id_, SIGKILL);
        ::waitpid(id_, nullptr, 0);
    }

    pid_t id() const { return id_; }
    bool works() const { return works_; }

private:
    pid_t id_ = -1;
    bool works_ = false;
};

bool fill(int file)
{
    static std::vector<char> const bytes(held_bytes, 'x');
    return ::write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
}

bool fill_memory_file()
{
    int const file = ::memfd_create("held", 0);
    return file >= 0 && fill(file);
}

char* map_shared()
{
    void* const pages =
        ::mmap(nullptr, held_bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (pages == MAP_FAILED)
        return nullptr;
    std::fill_n(static_cast<char*>(pages), held_bytes, 'x');
    return static_cast<char*>(pages);
}

bool become_nobody()
{
    return ::geteuid() != 0 || (::setresgid(nobody, nobody, nobody) == 0 &&
                                ::setresuid(nobody, nobody, nobody) == 0 && ::prctl(PR_SET_DUMPABLE, 1) == 0);
}

/// Over `/tmp`, in a namespace of its own.
bool mount_memory()
{
    auto const map = "0 " + std::to_string(::geteuid()) + " 1";
    bool const is_root = ::geteuid() == 0;
    if (::unshare(is_root ? CLONE_NEWNS : CLONE_NEWUSER | CLONE_NEWNS) != 0)
        return false;
    if (!is_root) {
        int const file = ::open("/proc/self/uid_map", O_WRONLY);
        bool const is_mapped = ::write(file, map.data(), map.size()) == static_cast<ssize_t>(map.size());
        ::close(file);
        if (!is_mapped)
            return false;
    }
    return ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
           ::mount("tmpfs", "/tmp", "tmpfs", 0, "size=64m") == 0;
}

/// As somebody without privileges sees it, who is the same user as these processes.
SharedMemory seen_by_nobody(std::vector<pid_t> const& processes)
{
    auto const [read_end, write_end] = make_pipe();
    auto const child = ::fork();
    if (child == 0) {
        SharedMemory found;
        if (become_nobody())
            found = adapters::shared_memory(processes);
        (void)!::write(write_end, &found, sizeof found);
        ::_exit(0);
    }
    ::close(write_end);
    SharedMemory found;
    BOOST_TEST(::read(read_end, &found, sizeof found) == static_cast<ssize_t>(sizeof found));
    ::close(read_end);
    ::waitpid(child, nullptr, 0);
    return found;
}

void check_held(SharedMemory const& found)
{
    BOOST_TEST(found.is_whole);
    BOOST_TEST(found.bytes >= held_bytes);
    BOOST_TEST(found.bytes < held_bytes + tolerance);
}

} // namespace

BOOST_AUTO_TEST_CASE(what_nobody_shares_is_not_counted)
{
    Child const child([] { return true; });
    auto const found = adapters::shared_memory({child.id()});
    BOOST_TEST(found.is_whole);
    BOOST_TEST(found.bytes == 0U);
}

BOOST_AUTO_TEST_CASE(a_file_in_memory_that_is_not_mapped_is_counted_once_whoever_has_it_open)
{
    Child const child([] { return fill_memory_file() && ::fork() >= 0 && ::dup(0) >= 0; });
    BOOST_TEST_REQUIRE(child.works());
    auto const tree = adapters::process_usage(child.id(), 10, held_bytes);
    BOOST_TEST(tree.own_memory_bytes > held_bytes);
    check_held(adapters::shared_memory({child.id(), child.id()}));
}

BOOST_AUTO_TEST_CASE(a_deleted_file_in_memory_is_counted)
{
    Child const child([] {
        auto const name = "/dev/shm/webots_cloud_held_" + std::to_string(::getpid());
        int const file = ::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
        bool const held = file >= 0 && fill(file);
        return ::unlink(name.c_str()) == 0 && held;
    });
    if (!child.works()) {
        BOOST_TEST_MESSAGE("skipped: /dev/shm can't be written");
        return;
    }
    check_held(adapters::shared_memory({child.id()}));
}

BOOST_AUTO_TEST_CASE(shared_pages_are_counted)
{
    Child const child([] { return become_nobody() && map_shared() != nullptr; });
    BOOST_TEST_REQUIRE(child.works());
    check_held(adapters::shared_memory({child.id()}));
    check_held(seen_by_nobody({child.id()}));
}

BOOST_AUTO_TEST_CASE(pages_that_are_mapped_no_longer_but_kept_by_another_one_are_counted_by_root)
{
    if (::geteuid() != 0) {
        BOOST_TEST_MESSAGE("skipped: only root sees what is behind a mapping");
        return;
    }
    Child const child([] {
        auto* const pages = map_shared();
        return pages && ::munmap(pages + 4096, held_bytes - 4096) == 0;
    });
    BOOST_TEST_REQUIRE(child.works());
    check_held(adapters::shared_memory({child.id()}));
}

BOOST_AUTO_TEST_CASE(what_only_one_thread_has_open_is_counted)
{
    Child const child([] {
        auto const [read_end, write_end] = make_pipe();
        std::thread([end = write_end] {
            bool const held = ::unshare(CLONE_FILES) == 0 && fill_memory_file();
            (void)!::write(end, held ? "y" : "n", 1);
            for (;;)
                ::pause();
        }).detach();
        char word = 0;
        return ::read(read_end, &word, 1) == 1 && word == 'y';
    });
    BOOST_TEST_REQUIRE(child.works());
    check_held(adapters::shared_memory({child.id()}));
}

BOOST_AUTO_TEST_CASE(a_file_system_in_memory_of_their_own_is_counted)
{
    Child const child([] {
        if (!mount_memory())
            return false;
        int const file = ::open("/tmp/held", O_RDWR | O_CREAT | O_EXCL, 0600);
        bool const held = file >= 0 && fill(file);
        ::close(file);
        return held && ::fork() >= 0;
    });
    if (!child.works()) {
        BOOST_TEST_MESSAGE("skipped: no user namespaces can be made");
        return;
    }
    check_held(adapters::shared_memory({child.id()}));
}

BOOST_AUTO_TEST_CASE(more_open_files_than_are_reasonable_are_not_looked_at)
{
    constexpr std::size_t processes = 70;
    constexpr std::size_t files_of_each = 1000;
    Child const child([] {
        rlimit const limit{files_of_each + 24, files_of_each + 24};
        if (::setrlimit(RLIMIT_NOFILE, &limit) != 0)
            return false;
        for (std::size_t i = 0; i < files_of_each; ++i)
            if (::dup(report) < 0)
                return false;
        return true;
    });
    BOOST_TEST_REQUIRE(child.works());
    BOOST_TEST(adapters::shared_memory({child.id()}).is_whole);
    std::vector<pid_t> const all(processes, child.id());
    BOOST_TEST(!adapters::shared_memory(all).is_whole);
}

// Of a limit that can't be exceeded nobody needs to know all.
BOOST_AUTO_TEST_CASE(it_counts_only_where_it_could_be_over_the_limit)
{
    Child const child([] { return fill_memory_file(); });
    Child const other([] { return fill(::open("/dev/null", O_WRONLY)); }); // as large, but for the file
    BOOST_TEST_REQUIRE(child.works());
    BOOST_TEST_REQUIRE(other.works());
    auto const surplus = [&](std::uint64_t limit) {
        auto const usage = [limit](pid_t id) {
            return static_cast<std::int64_t>(adapters::process_usage(id, 10, limit).own_memory_bytes);
        };
        return usage(child.id()) - usage(other.id());
    };
    constexpr auto half = static_cast<std::int64_t>(held_bytes / 2);
    BOOST_TEST(surplus(std::uint64_t{1} << 50) < half);
    BOOST_TEST(surplus(0) > half);
    BOOST_TEST(adapters::machine_shared_memory() >= held_bytes);
    BOOST_TEST(adapters::machine_shared_memory() < std::uint64_t{1} << 50);
}

BOOST_AUTO_TEST_CASE(memory_of_a_process_whose_first_thread_has_ended_is_counted)
{
    Child const child([] {
        std::thread([] {
            adapters::ProcBuffer buffer;
            std::vector<char> const held(held_bytes, 'x');
            auto const first = "/proc/" + std::to_string(::getpid()) + "/stat";
            while (adapters::read_start(first, buffer).find(") Z ") == std::string_view::npos)
                std::this_thread::yield();
            (void)!::write(report, held.data() + held.size() / 2, 1);
            for (;;)
                ::pause();
        }).detach();
        ::syscall(SYS_exit, 0);
        return false;
    });
    auto const usage = adapters::process_usage(child.id(), 10, std::uint64_t{1} << 50);
    BOOST_TEST(usage.own_memory_bytes > held_bytes);
    BOOST_TEST(usage.memory_bytes > held_bytes);
}

BOOST_AUTO_TEST_SUITE_END()
