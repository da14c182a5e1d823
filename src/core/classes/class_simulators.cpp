#include "class_simulators.hpp"

#include "core/text.hpp"

#include <boost/url/parse.hpp>
#include <boost/url/url_view.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

/// Of the parts of an address: views into it.
template<class Part>
std::string_view view_of(Part const& part)
{
    return {part.data(), part.size()};
}

std::string_view path_of(boost::urls::url_view const& url)
{
    auto path = view_of(url.encoded_path());
    while (path.ends_with('/'))
        path.remove_suffix(1);
    return path;
}

bool is_plain(boost::urls::url_view const& url)
{
    auto const scheme = lower_case(view_of(url.scheme()));
    return (scheme == "ws" || scheme == "wss") && !url.has_userinfo() && !url.has_query() &&
           !url.has_fragment() && !url.encoded_host().empty();
}

bool is_same_site(boost::urls::url_view const& one, boost::urls::url_view const& other)
{
    return lower_case(view_of(one.scheme())) == lower_case(view_of(other.scheme())) &&
           lower_case(view_of(one.encoded_host())) == lower_case(view_of(other.encoded_host()));
}

/// `/simulation/<token>/<port>`, and nothing after it. Tokens have letters alone.
bool is_below(std::string_view path, std::string_view machine)
{
    constexpr std::string_view folder = "/simulation/";
    if (!path.starts_with(machine) || !path.substr(machine.size()).starts_with(folder))
        return false;
    path.remove_prefix(machine.size() + folder.size());
    auto const token_end = path.find('/');
    auto const is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
    return token_end != std::string_view::npos && token_end > 0 &&
           std::all_of(path.begin(), path.begin() + token_end, is_letter) &&
           parse_port(path.substr(token_end + 1)) != 0;
}

/// `/2001` beside `/2000`; of a machine whose path has no port: `/webots/2001` below `/webots`.
bool is_beside(std::string_view path, std::string_view machine)
{
    auto const last = machine.rfind('/') + 1;
    auto const folder =
        parse_port(machine.substr(last)) != 0 ? std::string(machine.substr(0, last)) : concat(machine, "/");
    return path.starts_with(folder) && parse_port(path.substr(folder.size())) != 0;
}

} // namespace

StudentMachine student_machine(std::string_view entry, SiteAddresses const& addresses,
                               AskedAddress const& asked)
{
    StudentMachine machine;
    auto const path = addresses.path_below_us(entry, asked);
    machine.entry = path.empty() ? std::string(entry) : concat(asked_name, path);
    machine.reached_at = addresses.address_of(entry, asked);
    machine.is_closed = addresses.is_closed(entry, path);
    return machine;
}

std::string simulator_entry(std::string_view reported, StudentMachine const& machine)
{
    auto const url = boost::urls::parse_uri(reported);
    auto const own = boost::urls::parse_uri(machine.reached_at);
    if (!url || !own || !is_plain(*url) || !is_plain(*own) || !is_same_site(*url, *own))
        return {};
    auto const path = path_of(*url);
    auto const own_path = path_of(*own);
    bool const is_same_port = view_of(url->port()) == view_of(own->port());
    bool const has_path = !own_path.empty();
    bool const is_other_port = has_path ? is_same_port && is_beside(path, own_path)
                                        : path.empty() && parse_port(view_of(url->port())) != 0;
    bool const is_below_machine = is_same_port && is_below(path, own_path);
    if (!is_below_machine && (machine.is_closed || !is_other_port))
        return {};
    if (is_below_machine && has_path) // which a proxy may have below another path for each browser
        return concat(machine.entry, path.substr(own_path.size()));
    // With a path, the port is the session server's, and belongs to what a browser calls its host.
    std::string_view const entry = machine.entry;
    auto const name_end = entry.starts_with('[') ? entry.find(']') : 0;
    auto const host = entry.substr(0, entry.find_first_of(has_path ? "/" : ":/", name_end));
    if (has_path)
        return concat(host, path);
    return concat(host, ":", view_of(url->port()), path);
}

} // namespace webots_cloud::core
