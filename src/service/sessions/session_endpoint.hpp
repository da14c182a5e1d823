// `/session`, where a browser asks for a machine, over HTTP and as a WebSocket (protocol section 2.1).
#pragma once

#include "class_endpoint.hpp"
#include "core/access/token_buckets.hpp"
#include "core/pages/metrics_text.hpp"
#include "site_availability.hpp"
#include "site_context.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud {

/// Of answers for the pages of every site.
inline constexpr std::string_view html_for_any_origin =
    "Content-Type: text/html; charset=UTF-8\r\n"
    "X-Content-Type-Options: nosniff\r\n"
    "Access-Control-Allow-Origin: *\r\n"
    "Access-Control-Allow-Headers: x-requested-with\r\n"
    "Access-Control-Allow-Methods: POST, GET, OPTIONS\r\n";
inline constexpr std::string_view any_origin =
    html_for_any_origin.substr(html_for_any_origin.find("X-Content"));

/// Sends each browser to the machine that the Scheduler chooses, or to this server where it relays; counts
/// that, and limits how often a client may ask.
///
/// Lifetime: everything passed by reference must outlive it.   Thread-safety: one executor.
class SessionEndpoint
{
public:
    SessionEndpoint(SiteContext const& site, ClassEndpoint& classes, SiteAvailability& availability);

    /// The site's parameters are others than these were.
    void apply(SessionServiceConfig const& before);

    /// Whether this server takes `/client` itself.
    bool relays() const noexcept { return site_.config.service.relay && site_.hooks.websockets; }

    Answer answer(IncomingRequest const& request);
    boost::asio::awaitable<void> serve(ChannelInfo const& info, Channel& channel);

    /// Whether a client may ask for a place once more.
    bool may_ask(std::string_view quota_key, TimePoint now);

    /// Somebody was sent to a machine, or found none.
    void note_placement(bool is_placed, TimePoint now);

    void write_metrics(core::MetricsText& text) const;

private:
    template<class GetAsked>
    std::string place(TimePoint now, std::string_view token, core::SeatRequest seat,
                      GetAsked const& get_asked);
    std::string own_address(AskedAddress const& by) const;
    void set_budget();

    SiteContext const& site_;
    ClassEndpoint& classes_;
    SiteAvailability& availability_;
    core::TokenBuckets asked_; ///< Requests of each client for a place.
    std::uint64_t placed_ = 0;
    std::uint64_t refused_ = 0;
    std::uint64_t limited_ = 0;
};

} // namespace webots_cloud
