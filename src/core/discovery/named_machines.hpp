// The machines that one name stands for: what a name server's answers mean, and when it is asked again.
#pragma once

#include "machine_name.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/server_spec.hpp>
#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/name_answer.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

namespace name_limits {
/// More machines of one name are left out.
constexpr std::size_t machines = 1000;
/// A name is looked up again when its TTL is over, but not before and not after
constexpr Duration min_ttl = std::chrono::seconds(5);
constexpr Duration max_ttl = std::chrono::minutes(5);
/// while a machine is missing in the last answer, and
constexpr Duration max_ttl_missing = std::chrono::seconds(30);
/// after a failure, at first and at last.
constexpr Duration first_pause = std::chrono::seconds(5);
constexpr Duration max_pause = std::chrono::minutes(1);
/// How long the last answer is good for while nobody answers.
constexpr Duration memory = std::chrono::hours(1);
} // namespace name_limits

/// What a lookup changed, in sentences for the log; empty: nothing to say.
struct LookupNews
{
    std::string info;
    std::string warning;
};

/// A machine stays until two answers, one after the other, lack it: many name servers tell only some of the
/// addresses each time, and a wrong answer costs nothing. "There is no such name" is an answer.
class NamedMachines
{
public:
    /// `entry`: with a name that `parse_machine_name` reads.
    NamedMachines(ServerSpec entry, MachineName name) : entry_(std::move(entry)), name_(std::move(name)) {}

    ServerSpec const& entry() const noexcept { return entry_; }
    MachineName const& name() const noexcept { return name_; }

    /// Another way to treat the same machines.
    void treat_as(ServerSpec entry) { entry_ = std::move(entry); }

    /// When it is to be looked up next; at first: at once.
    TimePoint due() const noexcept { return due_; }

    LookupNews take(result<NameAnswer> const& answer, TimePoint now, bool loopback);

    /// Treated as the entry says. Of a service, weights are relative to their mean; machines of a later
    /// priority are drained as long as one of an earlier priority is not `unreachable`.
    std::vector<ServerSpec>
    machines(std::function<bool(std::string_view address)> const& unreachable = {}) const;

    /// Whether `machines` depends on who is unreachable.
    bool has_spares() const noexcept;

private:
    struct Machine
    {
        std::uint16_t priority = 0;
        std::uint16_t weight = 0;
        bool is_missing = false; ///< In the last answer.
    };
    using Machines = std::map<std::string, Machine>;

    Machines read(NameAnswer const& answer, bool loopback, std::string& warning) const;
    LookupNews replace(Machines told, std::string warning);
    LookupNews fail(Failure const& failure, TimePoint now);

    ServerSpec entry_;
    MachineName name_;
    Machines machines_;
    TimePoint due_{};
    TimePoint answered_{};
    Duration pause_{};    ///< After the last failure.
    std::string warning_; ///< The last one, which is not repeated.
};

} // namespace webots_cloud::core
