// What a ClientRelay knows of each browser and machine. For the files of ClientRelay alone.
#pragma once

#include "client_relay.hpp"

#include "async/wakeup.hpp"

#include <boost/asio/any_io_executor.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {
namespace relay {

inline constexpr std::uint16_t service_restart = 1012; // RFC 6455's registry: come back
/// Reports that are no older show whom others have placed. So machines are not asked more often than that.
inline constexpr Duration current_report = std::chrono::milliseconds(100);
/// A session whose world is known to need more than any free machine has left waits no longer than this for
/// room: it would slow down all simulations of a machine, which last for minutes.
inline constexpr Duration longest_wait_for_room = std::chrono::seconds(90);

} // namespace relay

struct ClientRelay::Machine
{
    Machine() = default;

    TimePoint freed{}; ///< When one of our simulations has ended there.
    TimePoint polled{};
};

/// What is known of a browser on its way to a machine, or there.
struct ClientRelay::Ride
{
    explicit Ride(boost::asio::any_io_executor const& executor) : changed(executor) {}

    std::string entry;
    std::string opening; ///< For the machine.
    Placement placement;
    bool is_placed = false;    ///< By the scheduler: it does not return.
    bool is_unclaimed = false; ///< The machine knows nothing of that.
    bool is_known = false;     ///< The machine has got the request.
    bool is_ready = false;
    bool is_at_fault = false; ///< The browser: nothing that happens says anything about the machine.
    std::size_t said = 0;     ///< Bytes of the browser, before there is a simulation.
    std::unique_ptr<Channel> machine;
    std::optional<async::TaskGroup::Task> task;
    async::Wakeup changed; ///< The task has ended, or a machine that was asked has answered.
    std::string problem;   ///< Of the machine that could not be reached.
};

/// What a browser has learned of machines that did not take it.
struct ClientRelay::Refusals
{
    Refusals() = default;

    /// A machine that has refused it, and until when it is not asked again: what keeps it may be mended.
    struct Refuser
    {
        std::string entry;
        TimePoint until;
    };

    bool is_by(std::string_view entry) const noexcept
    {
        return std::any_of(refusers.begin(), refusers.end(),
                           [entry](Refuser const& refuser) { return refuser.entry == entry; });
    }

    std::size_t failures = 0; ///< Machines that have refused it, and times that one was silent.
    std::vector<Refuser> refusers;
    std::vector<std::string> full;  ///< Machines that do not come into question at the moment.
    std::vector<std::string> needs; ///< Labels.
    std::string last_word;          ///< What the machine that refused last has said; empty: nothing.
    std::string last_reason;        ///< Its message `reason:` before that; empty: none.
};

/// A browser, from the handshake to the end of its connection. Those that wait are many, so it is small: what
/// only the others need is in `Ride`.
struct ClientRelay::Browser : core::WaitingRoom::Customer
{
    Browser(Id number, Channel& browser) : Customer(number), channel(browser) {}

    Refusals& refusals_so_far()
    {
        if (!refusals)
            refusals = std::make_unique<Refusals>();
        return *refusals;
    }

    // Kept close together: these are read for every waiting browser when places are told.
    Channel& channel;
    TimePoint told = TimePoint::min();
    core::WaitTold told_wait;
    core::WaitReason told_why = core::WaitReason::seat;
    bool wants_room = false; ///< Machines are free, but none has room for its world: others pass it.
    std::uint64_t world = 0; ///< A digest of the world and mode.
    core::RelayOptions options;

    AskedAddress asked;
    std::string client;
    std::string request;
    core::SeatRequest seat = core::SeatRequest::unknown;
    bool has_spoken = false;
    bool was_seated = false;
    bool came_back = false; ///< With a ticket.
    bool has_left = false;
    std::optional<core::WaitingId> ticket; ///< Of its place.
    TimePoint waits_since{};               ///< For a seat; before it has asked for one, since it came.
    TimePoint next_ticket = TimePoint::min();
    TimePoint not_before = TimePoint::min();
    std::unique_ptr<Refusals> refusals; ///< Null: no machine has refused it.
    std::unique_ptr<Ride> ride;
};

} // namespace webots_cloud
