#include "system_calls.hpp"

#include "exit_status.hpp"

#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>

namespace webots_cloud::guard {
namespace {

#if defined(__x86_64__)
constexpr std::uint32_t architecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t architecture = AUDIT_ARCH_AARCH64;
#else
#error "the filter has to know the architecture"
#endif

constexpr std::uint32_t first_x32_call = 0x40000000; // x86-64 with 32-bit pointers; no other has such numbers

constexpr std::uint32_t secret_memory = 447; // `memfd_secret`, which older headers do not know

constexpr std::initializer_list<std::uint32_t> forbidden = {
    SYS_add_key,        SYS_request_key,       SYS_keyctl,   SYS_bpf,
    SYS_userfaultfd,    SYS_perf_event_open,   SYS_syslog,   SYS_io_uring_setup,
    SYS_io_uring_enter, SYS_io_uring_register, secret_memory};

constexpr std::initializer_list<std::uint32_t> socket_families = {AF_UNIX, AF_INET, AF_INET6, AF_NETLINK};

/// A program in the kernel's language for filters, which ends with the first `give` that it comes to.
class Filter
{
public:
    void load(std::size_t offset) { add(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)); }
    void give(std::uint32_t result) { add(BPF_RET | BPF_K, result); }

    void give_if(std::uint32_t value, std::uint32_t result)
    {
        add(BPF_JMP | BPF_JEQ | BPF_K, value, 0, 1);
        give(result);
    }

    void give_unless(std::uint32_t value, std::uint32_t result)
    {
        add(BPF_JMP | BPF_JEQ | BPF_K, value, 1, 0);
        give(result);
    }

    void give_from(std::uint32_t value, std::uint32_t result)
    {
        add(BPF_JMP | BPF_JGE | BPF_K, value, 0, 1);
        give(result);
    }

    bool install()
    {
        sock_fprog program{};
        program.len = static_cast<unsigned short>(size_);
        program.filter = code_.data();
        return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
               prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) == 0;
    }

private:
    void add(int code, std::uint32_t value, std::uint8_t if_true = 0, std::uint8_t if_false = 0)
    {
        code_.at(size_++) = sock_filter{static_cast<std::uint16_t>(code), if_true, if_false, value};
    }

    std::array<sock_filter, 64> code_{};
    std::size_t size_ = 0;
};

constexpr std::uint32_t refuse_with(int error)
{
    return SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error);
}

bool forbid_system_calls()
{
    Filter filter;
    filter.load(offsetof(seccomp_data, arch));
    // Another architecture has other numbers: none of the conditions below would mean what it says.
    filter.give_unless(architecture, refuse_with(ENOSYS));
    filter.load(offsetof(seccomp_data, nr));
    filter.give_from(first_x32_call, refuse_with(ENOSYS));
    for (auto const call : forbidden)
        filter.give_if(call, refuse_with(EPERM));
    // All others are allowed; of `socket` the family decides.
    filter.give_unless(SYS_socket, SECCOMP_RET_ALLOW);
    filter.load(offsetof(seccomp_data, args)); // the lower half of the first one: both are little-endian
    for (auto const family : socket_families)
        filter.give_if(family, SECCOMP_RET_ALLOW);
    filter.give(refuse_with(EAFNOSUPPORT));
    return filter.install();
}

} // namespace

void execute_filtered(char** argv)
{
    if (forbid_system_calls())
        execv(argv[0], argv);
    std::printf("can't run %s: %s\n", argv[0], std::strerror(errno));
    std::fflush(stdout);
    _exit(exec_failed);
}

} // namespace webots_cloud::guard
