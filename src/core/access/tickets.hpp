// Tickets: what a session server gives to browsers so that a simulation server takes them in, once and soon.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::core {

/// A message authentication code of 32 bytes, with a secret that both servers know (HMAC-SHA256).
using Mac = std::function<std::string(std::string_view message)>;

constexpr std::size_t ticket_nonce_size = 16;
constexpr Duration ticket_lifetime = std::chrono::seconds(60);

/// `host/2000` and `HOST:2000` are the same server: `host:2000`.
std::string server_of_ticket(std::string_view address);

/// A ticket for one server: expiry, nonce and MAC, in base64url (RFC 4648, section 5).
/// Precondition: the nonce has `ticket_nonce_size` random bytes.
std::string make_ticket(Mac const& mac, std::string_view server, std::string_view nonce, WallTime now);

/// The ticket in `/ticket/<ticket>/client`; empty: it is another path.
std::string_view ticket_in(std::string_view path) noexcept;

enum class TicketVerdict
{
    accepted,
    missing,
    unknown, ///< Not made with our secret, or for another server.
    expired,
    used,
    too_many ///< More were used in their lifetime than are remembered.
};

/// What the browser is told; nothing: accepted.
std::optional<Failure> refusal(TicketVerdict verdict);

/// Accepts each ticket once.
class TicketBook
{
public:
    /// `names`: what this server may be called in a ticket, as `host:port`.
    TicketBook(Mac mac, std::vector<std::string> names, std::size_t max_used = 100'000);

    TicketVerdict redeem(std::string_view ticket, WallTime now);

    /// Used tickets that have not expired yet.
    std::size_t size() const noexcept { return used_.size(); }

private:
    Mac mac_;
    std::vector<std::string> names_;
    std::size_t max_used_;
    std::set<std::pair<std::string, std::string>>
        used_; ///< Expiry, as its bytes in order of size, and nonce.
};

} // namespace webots_cloud::core
