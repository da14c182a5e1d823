// Machines that announce themselves: what they send, and which are known by that.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// Where announcements are sent to, below the address of a session server.
inline constexpr std::string_view announcement_path = "/api/machines";
/// Between two of them.
constexpr Duration announcement_interval = std::chrono::seconds(10);

/// What a machine says of itself.
struct Announcement
{
    std::string machine; ///< As an entry of "simulationServers".
    WallTime at{};
    std::string receiver; ///< What the session server calls itself; empty: the machine does not know it yet.
    bool is_goodbye = false;
};

/// What a session server answers to an announcement for another one, or for nobody: for whom to sign.
std::string receiver_answer(std::string_view receiver);
/// Nothing, where it is no such answer.
std::optional<std::string> parse_receiver_answer(std::string_view body);

/// As the query of a URL, the form that is signed.
std::string announcement_query(Announcement const& announcement);
std::optional<Announcement> parse_announcement(std::string_view query);

/// The value of `Authorization` for a query. `mac`: HMAC-SHA256.
std::string sign_announcement(std::function<std::string(std::string_view)> const& mac,
                              std::string_view query);

enum class AnnouncementVerdict : std::uint8_t
{
    accepted,
    outdated, ///< Sent too long ago, or too far in the future.
    repeated, ///< Not later than the last one of that machine.
    refused,  ///< No machine that browsers could be sent to.
    too_many  ///< More machines than may be here, or are remembered.
};

/// Those that have announced themselves and have not said goodbye, nor been silent for three intervals.
class AnnouncedMachines
{
public:
    static constexpr std::size_t max_machines = 10'000; ///< That are remembered.
    static constexpr Duration patience = 3 * announcement_interval;
    /// Older announcements, and those from further in the future, are not accepted: clocks differ.
    static constexpr Duration max_age = std::chrono::minutes(2);

    /// `max_here`: no more are taken.
    explicit AnnouncedMachines(std::size_t max_here = max_machines) : max_here_(max_here) {}

    /// Precondition: the signature is right.
    AnnouncementVerdict take(Announcement const& announcement, bool loopback, TimePoint now, WallTime wall);

    /// Machines that have been silent for too long, longest first.
    std::vector<std::string> forget_silent(TimePoint now, WallTime wall);

    /// In the order of their names.
    std::vector<std::string> machines() const;

    std::size_t size() const noexcept { return here_.size(); }
    std::size_t max_here() const noexcept { return max_here_; }

private:
    /// Names in `machines_`, in the order in which the machines were heard last.
    using Order = std::list<std::string const*>;

    struct Machine
    {
        WallTime last{};     ///< By its own clock.
        TimePoint heard{};   ///< By ours.
        bool is_here = true; ///< Otherwise it is remembered so that nothing old brings it back.
        Order::iterator place;
    };

    std::size_t max_here_;
    std::map<std::string, Machine> machines_;
    Order here_;
    Order gone_;
};

} // namespace webots_cloud::core
