// The WebSocket /class of a session server (protocol section 13.15).
#pragma once

#include "core/classes/class_book.hpp"

#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/scheduler.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/logger.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace webots_cloud {

struct ClassEndpointHooks
{
    ClassEndpointHooks() = default;

    /// Empty: there are no classes.
    core::RandomBytes random_bytes;
    /// Where students find a page that a browser has asked for so, if that is a name for this machine alone.
    std::function<core::ClassNetwork(AskedAddress const& asked)> network;
    /// Where a browser that has asked us so reaches a machine: `wss://host/2000`, with a ticket if need be.
    std::function<std::string(std::string_view server, AskedAddress const& asked)> machine_address;
    /// The same without a ticket: `wss://host/2000/simulation/abc/2001`.
    std::function<std::string(std::string_view entry, AskedAddress const& asked)> simulator_address;
    /// As ClassStager::update.
    std::function<std::vector<int>(std::vector<core::StagingWish> classes)> stage;
};

/// Passes what browsers say to a ClassBook, and does what it says: sends, closes, holds seats.
///
/// Logs no names, codes, keys or tokens.
/// Lifetime: everything passed by reference must outlive it.   Thread-safety: one executor.
class ClassEndpoint
{
public:
    ClassEndpoint(LoadMonitor const& monitor, Scheduler& scheduler, Clock& clock, Logger log,
                  ClassEndpointHooks hooks);

    /// Empty: no class can be opened; those that exist go on.
    void set_password(std::string password);

    boost::asio::awaitable<void> serve(ChannelInfo info, Channel& channel);

    /// To be called about once a second.
    void update();

    /// The server is being stopped: all classes end.
    void stop();

    /// As in ClassBook.
    core::SeatRequest ask_for_seat(std::string_view token, TimePoint now);
    std::string class_of(std::string_view token) const { return book_.class_of(token); }
    void take_seat(std::string_view token, core::SeatRequest seat, core::StudentMachine machine,
                   TimePoint now);

    core::ClassFigures figures() const noexcept { return book_.figures(); }
    std::uint64_t pictures_relayed() const noexcept { return relayed_; }
    /// Since a teacher's browser did not keep up.
    std::uint64_t pictures_dropped() const noexcept { return dropped_; }

private:
    struct Conversation
    {
        Channel* channel = nullptr;
        AskedAddress asked;
    };

    core::ClassHooks book_hooks();
    std::vector<std::string> machines_for(core::ClassConnection teacher) const;
    void warn_of_guesses(std::string_view what, std::string_view quota_key) const;
    void carry_out();
    void send(Conversation const& to, core::ClassOutput output);

    LoadMonitor const& monitor_;
    Scheduler& scheduler_;
    Clock& clock_;
    Logger log_;
    ClassEndpointHooks hooks_;
    core::ClassBook book_;
    core::ClassConnection last_ = 0;
    std::unordered_map<core::ClassConnection, Conversation> conversations_;
    std::uint64_t relayed_ = 0;
    std::uint64_t dropped_ = 0;
};

} // namespace webots_cloud
