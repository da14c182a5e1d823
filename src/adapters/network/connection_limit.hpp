// Limits the connections of each client.
#pragma once

#include "core/access/client_limit.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/http_server.hpp>

#include <algorithm>
#include <string>

namespace webots_cloud::adapters {

/// Counts the connections of clients; refusals go to the log and the statistics.
///
/// Lifetime: everything passed by reference must outlive it, and it its tickets.
class ConnectionLimit
{
public:
    using Ticket = core::ClientLimit::Ticket;

    ConnectionLimit(std::size_t max, HttpServerStatistics& statistics, Logger const& log)
        : connections_(max), statistics_(statistics), log_(log)
    {}

    /// So many connections are all there can be: one client may not have more than three quarters of them.
    void leave_room(std::size_t all)
    {
        auto const share = std::max<std::size_t>(1, all - all / 4);
        connections_.set_all(all);
        is_lowered_ = share < connections_.max();
        if (is_lowered_)
            connections_.set_max(share);
    }

    /// `ticket` is replaced when the client is admitted.
    bool admit(std::string const& quota_key, Ticket& ticket)
    {
        auto const verdict = connections_.admit(quota_key, ticket);
        if (verdict == core::ClientLimit::Verdict::admitted)
            return true;
        ++statistics_.refused_address;
        if (verdict == core::ClientLimit::Verdict::refused_first)
            log_.warning(LogCause("connections"),
                         core::concat("More than ", std::to_string(connections_.refused().allowed),
                                      " connections from ", connections_.refused().key,
                                      " are refused: see \"connectionsPerAddress\"",
                                      is_lowered_ ? " and the limit of open files" : "",
                                      ", and \"trustedProxies\" if that is a proxy"));
        return false;
    }

private:
    core::ClientLimit connections_;
    HttpServerStatistics& statistics_;
    Logger const& log_;
    bool is_lowered_ = false; ///< By the limit of open files.
};

} // namespace webots_cloud::adapters
