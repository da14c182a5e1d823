// Machines that a session server which relays would rather not try: they hang, or refuse everybody.
#pragma once

#include "core/access/quota_counts.hpp"

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Remembers what machines did to browsers.
///
/// A machine that was silent is not tried for 10 s, then 20, 40 and so on, a minute at most: meanwhile it
/// costs nobody anything, and once in that time one browser waits for it in vain. A machine that refuses,
/// which a stranger's projects can bring about, is tried after all others, once browsers of four groups were
/// refused there in turn; nothing more, so that nobody can take a machine from the others. Of one network of
/// IPv6, however wide, at most three groups count (`QuotaLevels`), so no home brings that about alone.
/// Browsers of no group don't count.
class MachineFaults
{
public:
    void was_silent(std::string_view entry, TimePoint now);
    /// `group`: who was refused, as in WaitingRoom. `why`: a sentence that can be shown as it is.
    void has_refused(std::string_view entry, std::string_view group, std::string_view why);
    /// A simulation became ready there.
    void has_served(std::string_view entry);
    /// It has left the list.
    void forget(std::string_view entry);

    /// Not to be tried now.
    std::vector<std::string> silent(TimePoint now) const;
    /// To be tried last.
    std::vector<std::string> unwilling() const;
    /// What the machine said when it refused a start, if nothing became ready there since then; else empty.
    /// Valid until the machine is mentioned again.
    std::string_view last_refusal(std::string_view entry) const;

    static constexpr Duration first_pause = std::chrono::seconds(10);
    static constexpr Duration longest_pause = std::chrono::minutes(1);
    static constexpr std::size_t groups_refused = 4;

private:
    struct Faults
    {
        Faults() = default;

        Duration pause{};
        TimePoint until{};
        QuotaCounts refused;    ///< Groups, at most `groups_refused`.
        std::size_t groups = 0; ///< As many.
        std::string last_refusal;
    };

    std::map<std::string, Faults, std::less<>> machines_;
};

} // namespace webots_cloud::core
