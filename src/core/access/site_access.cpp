// Which names and pages a server accepts follows from how far its own name reaches: this machine, a private
// network, or everybody. docs/access.md has the table; access_control.cpp asks.
#include "site_access.hpp"

#include "asked_name.hpp"
#include "core/text.hpp"

#include <boost/url/authority_view.hpp>
#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>

#include <algorithm>
#include <optional>
#include <utility>

namespace webots_cloud::core {
namespace {

namespace urls = boost::urls;

constexpr std::string_view any_origin = "*";
constexpr std::string_view opaque_origin =
    "null"; // of pages opened from disk and of sandboxed frames (RFC 6454, 6.1)
constexpr std::string_view registry = "https://webots.cloud";

/// A host as a header or a configuration names it.
struct Host
{
    std::string name; ///< In small letters, without port, brackets and final dot.
    urls::host_type type = urls::host_type::none;
    Reach reach = Reach::everybody;
};

Reach reach_of_bytes(urls::ipv4_address::bytes_type const& bytes)
{
    if (bytes[0] == 127 || bytes[0] == 0)
        return Reach::this_machine;
    bool const is_private = bytes[0] == 10 || (bytes[0] == 172 && bytes[1] >= 16 && bytes[1] < 32) ||
                            (bytes[0] == 192 && bytes[1] == 168) || (bytes[0] == 169 && bytes[1] == 254);
    return is_private ? Reach::private_network : Reach::everybody;
}

Reach reach_of_address(urls::ipv6_address const& address)
{
    auto const bytes = address.to_bytes();
    if (address.is_loopback() || address.is_unspecified())
        return Reach::this_machine;
    if (address.is_v4_mapped())
        return reach_of_bytes({bytes[12], bytes[13], bytes[14], bytes[15]});
    bool const is_unique_local = (bytes[0] & 0xfe) == 0xfc;                   // fc00::/7
    bool const is_link_local = bytes[0] == 0xfe && (bytes[1] & 0xc0) == 0x80; // fe80::/10
    return is_unique_local || is_link_local ? Reach::private_network : Reach::everybody;
}

Reach reach_of_name(std::string_view name)
{
    if (name == "localhost" || name.ends_with(".localhost"))
        return Reach::this_machine;
    if (name.find('.') == std::string_view::npos)
        return Reach::private_network;
    // RFC 6762 and appendix G, RFC 8375, and ICANN's .internal: names that mean nothing on the Internet.
    for (std::string_view const suffix : {".local", ".localdomain", ".home.arpa", ".internal", ".intranet",
                                          ".private", ".corp", ".home", ".lan"})
        if (name.ends_with(suffix))
            return Reach::private_network;
    return Reach::everybody;
}

std::optional<Host> parse_host(std::string_view text)
{
    auto const authority = urls::parse_authority(text);
    if (!authority || authority->has_userinfo() || authority->encoded_host().empty())
        return std::nullopt;
    Host host;
    host.type = authority->host_type();
    switch (host.type) {
    case urls::host_type::ipv4:
        host.name = authority->host_ipv4_address().to_string();
        host.reach = reach_of_bytes(authority->host_ipv4_address().to_bytes());
        break;
    case urls::host_type::ipv6:
        host.name = authority->host_ipv6_address().to_string();
        host.reach = reach_of_address(authority->host_ipv6_address());
        break;
    case urls::host_type::name:
        host.name = lower_case(authority->host_name());
        if (host.name.ends_with('.'))
            host.name.pop_back();
        host.reach = reach_of_name(host.name);
        break;
    default:
        return std::nullopt;
    }
    return host;
}

bool is_address(Host const& host) noexcept
{
    return host.type == urls::host_type::ipv4 || host.type == urls::host_type::ipv6;
}

/// What follows the scheme of an origin.
std::optional<Host> host_of_origin(std::string_view origin)
{
    auto const scheme_end = origin.find("://");
    return scheme_end == std::string_view::npos ? std::nullopt : parse_host(origin.substr(scheme_end + 3));
}

/// Scheme, host and port as origins are compared: small letters, no default port.
std::string comparable(std::string_view origin)
{
    auto text = lower_case(origin);
    for (auto const& [scheme, port] : {std::pair("https://", ":443"), std::pair("http://", ":80")})
        if (text.starts_with(scheme) && text.ends_with(port))
            text.erase(text.size() - std::string_view(port).size());
    return text;
}

/// `*` stands for one name or several: `https://*.example.org` matches `https://a.b.example.org`.
bool matches(std::string_view origin, std::string_view pattern)
{
    auto const star = pattern.find('*');
    if (star == std::string_view::npos)
        return origin == pattern;
    auto const head = pattern.substr(0, star);
    auto const tail = pattern.substr(star + 1);
    return origin.size() > head.size() + tail.size() && origin.starts_with(head) && origin.ends_with(tail);
}

} // namespace

Reach reach_of(std::string_view host)
{
    auto const parsed = parse_host(host);
    return parsed ? parsed->reach : Reach::everybody;
}

bool is_origin_pattern(std::string_view text)
{
    if (text == any_origin || text == opaque_origin)
        return true;
    auto const scheme_end = text.find("://");
    if (scheme_end == std::string_view::npos || scheme_end == 0)
        return false;
    auto host = text.substr(scheme_end + 3);
    if (host.starts_with("*."))
        host.remove_prefix(2);
    return host.find('*') == std::string_view::npos && parse_host(host).has_value();
}

SiteAccess::SiteAccess(Reach reach, std::vector<std::string> const& names,
                       std::vector<std::string> const* origins)
    : reach_(reach), any_origin_(!origins && reach == Reach::everybody)
{
    for (auto const& name : names) {
        any_private_name_ = any_private_name_ || name == asked_name;
        if (auto const host = parse_host(name))
            names_.push_back(host->name);
    }
    if (!origins && !any_origin_)
        origins_.emplace_back(registry);
    if (!origins)
        return;
    for (auto const& origin : *origins) {
        any_origin_ = any_origin_ || origin == any_origin;
        origins_.push_back(comparable(origin));
    }
}

bool SiteAccess::is_own_name(std::string_view name) const
{
    return std::find(names_.begin(), names_.end(), name) != names_.end();
}

bool SiteAccess::knows_host(std::string_view host) const
{
    if (host.empty() || host == last_known_host_)
        return true;
    if (!is_known_host(host))
        return false;
    last_known_host_ = host;
    return true;
}

bool SiteAccess::is_known_host(std::string_view host) const
{
    auto const parsed = parse_host(host);
    return parsed &&
           (is_address(*parsed) || parsed->reach == Reach::this_machine || is_own_name(parsed->name) ||
            (any_private_name_ && parsed->reach == Reach::private_network));
}

bool SiteAccess::accepts_origin(std::string_view origin, std::string_view host) const
{
    if (any_origin_ || origin.empty() ||
        (origin == last_accepted_page_.origin && host == last_accepted_page_.host))
        return true;
    if (!is_accepted_page(origin, host))
        return false;
    last_accepted_page_.origin = origin;
    last_accepted_page_.host = host;
    return true;
}

bool SiteAccess::is_accepted_page(std::string_view origin, std::string_view host) const
{
    auto const text = comparable(origin);
    bool const is_listed = std::any_of(origins_.begin(), origins_.end(),
                                       [&](std::string const& pattern) { return matches(text, pattern); });
    if (is_listed)
        return true;
    auto const page = host_of_origin(origin);
    if (!page)
        return false;
    if (is_own_name(page->name))
        return true;
    if (page->reach == Reach::this_machine)
        return reach_ != Reach::everybody;
    auto const asked = parse_host(host);
    bool const may_be_ours =
        is_address(*page) || (any_private_name_ && page->reach == Reach::private_network);
    return may_be_ours && asked && asked->name == page->name;
}

bool SiteAccess::is_own_page(std::string_view origin, std::string_view host) const
{
    if (origin.empty())
        return true;
    auto const scheme_end = origin.find("://");
    return scheme_end != std::string_view::npos && !host.empty() && knows_host(host) &&
           lower_case(origin.substr(scheme_end + 3)) == lower_case(host);
}

bool SiteAccess::has_own_name(std::string_view origin) const
{
    auto const page = host_of_origin(origin);
    return page && is_own_name(page->name);
}

std::string SiteAccess::frame_ancestors() const
{
    if (any_origin_)
        return "*";
    std::string sources = "'self'";
    for (auto const& origin : origins_)
        if (origin != opaque_origin)
            sources.append(" ").append(origin);
    return sources;
}

} // namespace webots_cloud::core
