// Announcements are signed, and carry a time and a receiver. Machines that fall silent are forgotten.
// docs/discovery.md says what operators see of it, protocol section 13.17 what is sent.
#include "announcements.hpp"

#include "core/base64.hpp"
#include "core/public_place.hpp"
#include "core/text.hpp"
#include "core/web_form.hpp"
#include "machine_name.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>

namespace webots_cloud::core {
namespace {

constexpr std::string_view announcement_purpose =
    "webots_cloud announcement 1\n"; // the secret is used for tickets, too
constexpr std::string_view announcement_scheme = "Webots-Cloud ";
constexpr std::string_view before_receiver = "&to=";
constexpr std::string_view goodbye = "&goodbye";
constexpr std::string_view receiver_prefix = "Sign for this session server: to=";
constexpr std::size_t max_receiver = 64;
constexpr std::size_t max_machine = 253 + 100; // a name, and a port or a path

std::int64_t milliseconds_of(WallTime time)
{
    return std::chrono::duration_cast<std::chrono::milliseconds>(time.time_since_epoch()).count();
}

/// What a query may have as it is: the letters of base64url.
bool is_receiver(std::string_view name)
{
    return !name.empty() && name.size() <= max_receiver &&
           name.find_first_not_of(base64url_digits) == std::string_view::npos;
}

/// `host:port`, `host/port` or `host/path`, with a port from 1 to 65535.
bool is_announced_address(std::string_view machine, bool loopback)
{
    auto const path = path_in(machine);
    auto const end =
        path.empty() ? std::min(machine.size(), machine.rfind(':')) : machine.size() - path.size();
    bool const is_placed = path.empty() ? parse_port(machine.substr(std::min(machine.size(), end + 1))) != 0
                                        : is_machine_path(path);
    if (machine.size() > max_machine || !is_placed)
        return false;
    auto const host = machine.substr(0, end);
    bool const is_v6 = host.starts_with('[') && host.ends_with(']') &&
                       IpAddress::parse(host.substr(1, host.size() - 2)).has_value();
    return (is_v6 || parse_machine_name(concat("srv:", host))) && is_machine_host(host, loopback);
}

} // namespace

std::string announcement_query(Announcement const& announcement)
{
    return concat("machine=", percent_encode(announcement.machine),
                  "&at=", std::to_string(milliseconds_of(announcement.at)),
                  announcement.receiver.empty() ? "" : before_receiver, announcement.receiver,
                  announcement.is_goodbye ? goodbye : "");
}

std::optional<Announcement> parse_announcement(std::string_view query)
{
    constexpr std::string_view before_machine = "machine=";
    constexpr std::string_view before_time = "&at=";
    Announcement announcement;
    announcement.is_goodbye = query.ends_with(goodbye);
    if (announcement.is_goodbye)
        query.remove_suffix(goodbye.size());
    if (auto const to = query.rfind(before_receiver); to != std::string_view::npos) {
        announcement.receiver = query.substr(to + before_receiver.size());
        if (!is_receiver(announcement.receiver))
            return std::nullopt;
        query = query.substr(0, to);
    }
    auto const middle = query.find(before_time);
    if (!query.starts_with(before_machine) || middle == std::string_view::npos)
        return std::nullopt;
    auto const machine = query.substr(before_machine.size(), middle - before_machine.size());
    auto const time = query.substr(middle + before_time.size());
    std::int64_t at = 0;
    auto const [end, failed] = std::from_chars(time.data(), time.data() + time.size(), at);
    constexpr std::int64_t latest = 4'000'000'000'000; // in the year 2096: far from what a clock can't hold
    if (failed != std::errc() || end != time.data() + time.size() || at < 0 || at > latest ||
        !percent_decode(machine, announcement.machine) || announcement.machine.empty())
        return std::nullopt;
    announcement.at = WallTime(std::chrono::milliseconds(at));
    return announcement;
}

std::string receiver_answer(std::string_view receiver)
{
    return concat(receiver_prefix, receiver);
}

std::optional<std::string> parse_receiver_answer(std::string_view body)
{
    body = trim(body);
    if (!body.starts_with(receiver_prefix) || !is_receiver(body.substr(receiver_prefix.size())))
        return std::nullopt;
    return std::string(body.substr(receiver_prefix.size()));
}

std::string sign_announcement(std::function<std::string(std::string_view)> const& mac, std::string_view query)
{
    return concat(announcement_scheme, base64url(mac(concat(announcement_purpose, query))));
}

AnnouncementVerdict AnnouncedMachines::take(Announcement const& announcement, bool loopback, TimePoint now,
                                            WallTime wall)
{
    using enum AnnouncementVerdict;
    if (!is_announced_address(announcement.machine, loopback))
        return refused;
    // An announcement that somebody has recorded is of no use again: it is too old, or not later than the
    // last one that we know.
    if (announcement.at < wall - max_age || announcement.at > wall + max_age)
        return outdated;
    auto const name = lower_case(announcement.machine);
    auto known = machines_.find(name);
    if (known != machines_.end() && announcement.at <= known->second.last)
        return repeated;
    bool const comes = !announcement.is_goodbye && (known == machines_.end() || !known->second.is_here);
    if (comes && here_.size() >= max_here_)
        return too_many;
    // Machines that have gone stay known for a while, for the sake of the time of their last announcement.
    if (known == machines_.end()) {
        if (machines_.size() >= max_machines)
            return too_many;
        known = machines_.emplace(name, Machine()).first;
        known->second.place = here_.insert(here_.end(), &known->first);
    }
    auto& machine = known->second;
    auto& before = machine.is_here ? here_ : gone_;
    machine.last = announcement.at;
    machine.heard = now;
    machine.is_here = !announcement.is_goodbye;
    auto& order = machine.is_here ? here_ : gone_;
    order.splice(order.end(), before, machine.place);
    return accepted;
}

std::vector<std::string> AnnouncedMachines::forget_silent(TimePoint now, WallTime wall)
{
    std::vector<std::string> silent;
    while (!here_.empty()) {
        auto& machine = machines_.find(*here_.front())->second;
        if (now - machine.heard < patience)
            break;
        machine.is_here = false;
        silent.push_back(*here_.front());
        gone_.splice(gone_.end(), here_, here_.begin());
    }
    // What is older than `max_age` is refused without being remembered. One whose clock is ahead holds up
    // those that went after it, for that long at most.
    while (!gone_.empty()) {
        auto const machine = machines_.find(*gone_.front());
        if (machine->second.last >= wall - max_age)
            break;
        gone_.pop_front();
        machines_.erase(machine);
    }
    return silent;
}

std::vector<std::string> AnnouncedMachines::machines() const
{
    std::vector<std::string> here;
    for (auto const& [name, machine] : machines_)
        if (machine.is_here)
            here.push_back(name);
    return here;
}

} // namespace webots_cloud::core
