#include "git_lfs_address.hpp"

#include "core/access/public_networks.hpp"
#include "core/access/site_access.hpp"
#include "core/text.hpp"

#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>

#include <algorithm>
#include <optional>

namespace webots_cloud::core {
namespace {

namespace urls = boost::urls;

struct Origin
{
    bool tls = false;
    std::string host; ///< In small letters, IPv6 in brackets.
};

std::optional<Origin> read_origin(std::string_view url)
{
    auto const parsed = urls::parse_uri(url);
    if (!parsed || parsed->has_userinfo() || parsed->encoded_host().empty())
        return std::nullopt;
    auto const scheme = lower_case(parsed->scheme());
    std::string_view const host = parsed->encoded_host();
    if ((scheme != "https" && scheme != "http") || host.find('%') != std::string_view::npos)
        return std::nullopt;
    Origin origin;
    origin.tls = scheme == "https";
    origin.host = lower_case(host);
    return origin;
}

std::string_view without_brackets(std::string_view host)
{
    return host.starts_with('[') && host.ends_with(']') ? host.substr(1, host.size() - 2) : host;
}

/// Names that end in a number are addresses in one of their older spellings (`127.1`, `0x7f000001`).
bool is_odd_number(std::string_view host)
{
    auto const last = host.substr(host.rfind('.') + 1); // all of it, where there is no dot
    return last.empty() || (last.front() >= '0' && last.front() <= '9');
}

bool is_public_host(std::string_view host)
{
    if (auto const address = IpAddress::parse(without_brackets(host)))
        return is_public_address(*address);
    return !is_odd_number(host) && reach_of(host) == Reach::everybody;
}

Failure refused(std::string_view what)
{
    return {errc::refused, std::string(what)};
}

} // namespace

std::string_view base_of(std::string_view url) noexcept
{
    constexpr std::string_view mark = "://";
    auto const scheme = url.find(mark);
    return scheme == std::string_view::npos ? url
                                            : url.substr(0, url.find_first_of("/?#", scheme + mark.size()));
}

std::string host_of_lfs_address(std::string_view url)
{
    auto const origin = read_origin(url);
    return origin ? std::string(without_brackets(origin->host)) : std::string();
}

result<> check_lfs_address(std::string_view url, std::string_view forge)
{
    auto const origin = read_origin(url);
    auto const home = read_origin(forge);
    if (!origin || !home)
        return refused("sends an address that is not HTTPS");
    if (home->tls && !origin->tls)
        return refused("sends an address without TLS");
    bool const is_private_home = !is_public_host(home->host);
    if (origin->host != home->host && !is_private_home && !is_public_host(origin->host))
        return refused("sends an address of a private network");
    return {};
}

} // namespace webots_cloud::core
