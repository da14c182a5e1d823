// Which host names a server answers to, and which web pages may open its WebSockets.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// From where the name of a server leads to it.
enum class Reach
{
    this_machine,    ///< `localhost` and loopback addresses.
    private_network, ///< Names without a dot, names such as `pc7.local`, and private addresses (RFC 1918, RFC
                     ///< 4193).
    everybody
};

/// The reach of a host name or address, with or without a port. Empty or malformed: `everybody`.
Reach reach_of(std::string_view host);

/// A wider reach wins.
inline Reach wider(Reach left, Reach right) noexcept
{
    return left < right ? right : left;
}

/// True for an origin of a configuration: `https://example.org`, `https://*.example.org`, `http://pc7:8080`,
/// `null` or `*`.
bool is_origin_pattern(std::string_view text);

/// The host names that a server has, and the origins (RFC 6454) of the pages that may talk with it.
///
/// Protects against DNS rebinding, where a hostile site points its own name to the address of this machine: a
/// foreign name in `Host` reveals such a page. An address as `Host` is always accepted, since no site
/// can own one. One thread at a time: even questions remember.
class SiteAccess
{
public:
    /// A public site, which checks nothing.
    SiteAccess() = default;

    /// `names`: how this machine is called besides `localhost`, with or without ports; `*`: by any name of a
    /// private network as well, such as `pc7.local`, which no site on the Internet can have. `origins`:
    /// patterns as `is_origin_pattern` knows them; null: the default of the reach.
    SiteAccess(Reach reach, std::vector<std::string> const& names, std::vector<std::string> const* origins);

    /// Whether there are origins that are not accepted.
    bool checks_origins() const noexcept { return !any_origin_; }

    /// Whether every request must name a host that is ours: only where no other name can be right.
    bool checks_hosts() const noexcept { return reach_ == Reach::this_machine; }

    /// Whether a `Host` header names this machine. Empty, as of a client of HTTP/1.0: true, since browsers
    /// always send one.
    bool knows_host(std::string_view host) const;

    /// Whether a page of `origin` may open a WebSocket, `host` being the request's `Host`. Empty, as of
    /// programs: true.
    bool accepts_origin(std::string_view origin, std::string_view host) const;

    /// Whether a page of `origin` is one of this server, `host` being the request's `Host`. Empty, as of
    /// programs: true.
    bool is_own_page(std::string_view origin, std::string_view host) const;

    /// Whether the host of `origin` is one of our names, on whatever port.
    bool has_own_name(std::string_view origin) const;

    /// The value of `frame-ancestors` in a Content-Security-Policy: `*`, or `'self'` and the origins.
    std::string frame_ancestors() const;

private:
    /// A page that was accepted, as its request said it.
    struct Page
    {
        std::string origin, host;
    };

    bool is_own_name(std::string_view name) const;
    bool is_known_host(std::string_view host) const;
    bool is_accepted_page(std::string_view origin, std::string_view host) const;

    Reach reach_ = Reach::everybody;
    bool any_origin_ = true;
    bool any_private_name_ = false;    ///< This machine may have names of its network that nobody listed.
    std::vector<std::string> names_;   ///< Without ports, in lower case.
    std::vector<std::string> origins_; ///< In lower case, without default ports.

    // Nearly all requests of a site say the same, letter for letter: what was accepted last is not parsed
    // again.
    mutable std::string last_known_host_;
    mutable Page last_accepted_page_;
};

} // namespace webots_cloud::core
