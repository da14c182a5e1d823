// Whether somebody who comes now gets a simulation, told to browsers on the WebSocket `/` and to whoever asks
// for `/` or `/request` (protocol sections 2.2 and 2.5).
#pragma once

#include "core/pages/metrics_text.hpp"
#include "core/site_state.hpp"
#include "site_context.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <string_view>
#include <unordered_set>

namespace webots_cloud {

/// Remembers what browsers were told, and tells them what changes.
///
/// Lifetime: the site must outlive it, and the browsers must have left.
/// Thread-safety: one executor.
class SiteAvailability
{
public:
    explicit SiteAvailability(SiteContext const& site) : site_(site) {}

    /// Machines, reports or placements have changed; to be called about once a second as well, as
    /// placements time out and reports become stale without an event.
    void update(TimePoint now);

    /// So many wait for a machine now.
    void note_line(std::size_t waiting);

    core::SiteState state() const noexcept { return state_; }

    /// What the state were if nobody waited.
    core::SiteState supply(TimePoint now) const;

    /// Whether a browser that comes now, to be relayed, is served or may wait.
    bool takes_more(TimePoint now) const;

    /// People, who have typed the address, are led to `start_page`.
    Answer answer(IncomingRequest const& request, std::string_view start_page) const;

    boost::asio::awaitable<void> serve(ChannelInfo info, Channel& channel);

    void write_metrics(core::MetricsText& text) const;

private:
    core::SiteState state_with(std::size_t waiting, bool is_available, TimePoint now) const;

    SiteContext const& site_;
    std::size_t waiting_ = 0;
    bool is_available_ = false;
    core::SiteState state_ = core::SiteState::unknown;
    std::unordered_set<Channel*> browsers_;       ///< Those that watch availability,
    std::unordered_set<Channel*> state_browsers_; ///< and that ask for the state of the site instead.
};

} // namespace webots_cloud
