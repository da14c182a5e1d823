#include "https_address.hpp"

#include "core/text.hpp"

#include <boost/url/authority_view.hpp>
#include <boost/url/parse.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

namespace urls = boost::urls;

constexpr std::uint16_t default_port = 443;

} // namespace

std::string https_address(std::string_view host, SiteAccess const& site, std::string_view server,
                          std::uint16_t port, std::string_view target)
{
    auto const own = urls::parse_authority(server);
    auto const asked = urls::parse_authority(host);
    bool const keeps_name = asked && !asked->encoded_host().empty() && site.knows_host(host);
    std::string name = "localhost";
    if (own && !own->encoded_host().empty())
        name = own->encoded_host();
    if (keeps_name)
        name = asked->encoded_host();
    if (own && own->has_port()) // a public one, as behind a router that maps ports
        port = own->port_number();
    auto const suffix = port == default_port ? std::string() : concat(":", std::to_string(port));
    return concat("https://", name, suffix, target.starts_with('/') ? "" : "/", target);
}

std::string_view challenge_in(std::string_view path) noexcept
{
    constexpr std::string_view folder = "/.well-known/acme-challenge/";
    constexpr std::size_t longest = 200;
    if (!path.starts_with(folder))
        return {};
    auto const name = path.substr(folder.size());
    bool const is_token = std::all_of(name.begin(), name.end(), [](char c) {
        return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '-' ||
               c == '_';
    });
    return is_token && name.size() <= longest ? name : std::string_view();
}

} // namespace webots_cloud::core
