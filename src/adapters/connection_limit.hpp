// How many connections each client may have.
#pragma once

#include "../core/client_limit.hpp"
#include "../core/line_budget.hpp"
#include "../core/text.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/time.hpp>

#include <string>

namespace webots_cloud::adapters {

/// Counts connections of clients, and says in the log and the statistics whom it refused.
///
/// Lifetime: everything passed by reference must outlive it, and it its tickets.
class ConnectionLimit
{
public:
    using Ticket = core::ClientLimit::Ticket;

    ConnectionLimit(std::size_t most, HttpServerStatistics& statistics, Logger const& log)
        : connections_(most), statistics_(statistics), log_(log)
    {}

    /// `ticket` is replaced when the client is admitted.
    bool admit(std::string const& quota_key, Ticket& ticket)
    {
        auto const verdict = connections_.admit(quota_key, ticket);
        if (verdict == core::ClientLimit::Verdict::admitted)
            return true;
        ++statistics_.refused_address;
        if (verdict == core::ClientLimit::Verdict::refused_first &&
            lines_.take(std::chrono::steady_clock::now()))
            log_.warning(core::concat("More than ", std::to_string(connections_.most()), " connections from ",
                                      quota_key,
                                      " are refused: see \"connectionsPerAddress\", and "
                                      "\"trustedProxies\" if that is a proxy"));
        return false;
    }

private:
    core::ClientLimit connections_;
    HttpServerStatistics& statistics_;
    Logger const& log_;
    core::LineBudget lines_{10, 1.0 / 6};
};

} // namespace webots_cloud::adapters
