// `/monitor` of a session server: a page, the JSON from which its script draws, and a WebSocket with what
// changes (protocol section 2.4).
#pragma once

#include "client_relay.hpp"
#include "core/pages/session_board.hpp"
#include "core/pages/shared_page.hpp"
#include "service/monitor_feed.hpp"
#include "site_availability.hpp"
#include "site_context.hpp"

#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud {

/// Makes each text once a second at most, for all who ask or watch.
///
/// Lifetime: everything passed by reference must outlive it.   Thread-safety: one executor.
class MonitorEndpoint
{
public:
    MonitorEndpoint(SiteContext const& site, ClientRelay const& relay, SiteAvailability const& availability);

    /// The site's parameters, or those of its LoadMonitor, are others.
    void apply();

    /// A machine of the fleet, as FleetObserver says; the LoadMonitor knows it already.
    void put(FleetMachine const& machine, FleetMachine const* was, std::optional<std::string_view> before);
    void remove(FleetMachine const& machine) { board_.remove(machine.spec.address); }

    /// A poll has told something new of it.
    void change(std::string_view machine) { board_.change(machine); }

    /// Something has changed that whoever changed it wants to see at once.
    void expire();

    /// To be called about once a second: tells those who watch.
    void update();

    Answer answer(IncomingRequest const& request);
    boost::asio::awaitable<void> serve(Channel& channel);

private:
    void look();
    std::string snapshot();
    std::string page();

    SiteContext const& site_;
    ClientRelay const& relay_;
    SiteAvailability const& availability_;
    WallTime started_;
    core::SessionBoard board_;
    MonitorFeed feed_; ///< To those that watch.
    core::TimedPage html_;
    core::TimedPage json_;
    /// The first text for browsers that connect before the next update; empty: not made yet.
    std::string greeting_;
};

} // namespace webots_cloud
