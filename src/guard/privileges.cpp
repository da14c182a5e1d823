#include "privileges.hpp"

#include <linux/capability.h>
#include <mntent.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>

namespace webots_cloud::guard {
namespace {

// <linux/landlock.h> of Debian 12 does not have scopes yet.
struct LandlockRuleset
{
    std::uint64_t handled_access_fs = 0;
    std::uint64_t handled_access_net = 0;
    std::uint64_t scoped = 0;
};
constexpr std::uint64_t landlock_scope_signal = 1U << 1;
constexpr unsigned landlock_ask_version = 1;
constexpr long first_version_with_scopes = 6;
constexpr long landlock_create_ruleset = 444; // the same on every architecture
constexpr long landlock_restrict_self = 446;

// What programs of root need for files, for changing users and for the network. Docker leaves containers the
// same, except for device files.
constexpr std::initializer_list<int> kept = {
    CAP_CHOWN,   CAP_DAC_OVERRIDE, CAP_FOWNER,     CAP_FSETID,  CAP_KILL,
    CAP_SETGID,  CAP_SETUID,       CAP_SETPCAP,    CAP_SETFCAP, CAP_NET_BIND_SERVICE,
    CAP_NET_RAW, CAP_SYS_CHROOT,   CAP_AUDIT_WRITE};
constexpr int max_capabilities = 64;

bool hides_processes()
{
    std::FILE* const mounts = setmntent("/proc/self/mounts", "re");
    bool hides = false;
    while (mntent const* const each = mounts ? getmntent(mounts) : nullptr)
        if (std::strcmp(each->mnt_dir, "/proc") == 0)
            hides = std::strstr(each->mnt_opts, "hidepid=") != nullptr; // the last one is on top
    if (mounts)
        endmntent(mounts);
    return hides;
}

} // namespace

void forbid_tracing()
{
    prctl(PR_SET_DUMPABLE, hides_processes() ? 1 : 0);
}

void drop_capabilities()
{
    prctl(PR_CAP_AMBIENT, PR_CAP_AMBIENT_CLEAR_ALL, 0, 0, 0);
    for (int each = 0; each < max_capabilities; ++each)
        if (std::find(kept.begin(), kept.end(), each) == kept.end())
            prctl(PR_CAPBSET_DROP, each, 0, 0, 0); // takes effect when the program is executed
}

bool can_confine_signals()
{
    return syscall(landlock_create_ruleset, nullptr, 0, landlock_ask_version) >= first_version_with_scopes;
}

bool confine_signals()
{
    if (!can_confine_signals())
        return false;
    LandlockRuleset ruleset;
    ruleset.scoped = landlock_scope_signal;
    auto const made = static_cast<int>(syscall(landlock_create_ruleset, &ruleset, sizeof ruleset, 0));
    if (made < 0)
        return false;
    bool const confined =
        prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 && syscall(landlock_restrict_self, made, 0) == 0;
    close(made);
    return confined;
}

} // namespace webots_cloud::guard
