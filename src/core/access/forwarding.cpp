// Paths and addresses of the gateway are taken apart here, and nowhere else: a request chooses a listed
// machine by its number and can't say where that is. Paths for operators never pass.
#include "forwarding.hpp"

#include "core/text.hpp"
#include "ip_address.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::core {
namespace {

/// What follows `https://` or `wss://`; empty: there is neither.
std::string_view behind_tls_scheme(std::string_view text) noexcept
{
    for (std::string_view const scheme : {"https://", "wss://"})
        if (text.starts_with(scheme))
            return text.substr(scheme.size());
    return {};
}

bool is_name_of_host(std::string_view text)
{
    constexpr std::size_t longest = 253;
    return text.size() <= longest && std::all_of(text.begin(), text.end(), [](char c) {
               return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                      c == '-' || c == '.' || c == '_';
           });
}

} // namespace

std::optional<InternalAddress> parse_internal_address(std::string_view text)
{
    InternalAddress parsed;
    auto const encrypted = behind_tls_scheme(text);
    if (auto const numeric = parse_numeric_address(encrypted.empty() ? text : encrypted)) {
        parsed.host = numeric->host;
        parsed.port = numeric->port;
        parsed.tls = !encrypted.empty();
        return parsed;
    }
    auto const colon = encrypted.rfind(':');
    if (colon == std::string_view::npos)
        return std::nullopt;
    auto const host = encrypted.substr(0, colon);
    parsed.port = parse_port(encrypted.substr(colon + 1));
    // Digits and dots alone are an address with a mistake in it.
    bool const is_name =
        is_name_of_host(host) && host.find_first_not_of("0123456789.") != std::string_view::npos;
    if (!is_name || parsed.port == 0)
        return std::nullopt;
    parsed.host = lower_case(host);
    parsed.tls = true;
    return parsed;
}

std::string internal_url(std::string_view internal_address, std::string_view path)
{
    auto const encrypted = behind_tls_scheme(internal_address);
    return encrypted.empty() ? concat("http://", internal_address, path)
                             : concat("https://", encrypted, path);
}

InternalRequest internal_request(std::string_view internal_address, std::string_view internal_name,
                                 std::string_view path)
{
    InternalRequest request;
    if (internal_name.empty()) {
        request.url = internal_url(internal_address, path);
        return request;
    }
    auto const machine = *parse_internal_address(internal_address);
    request.url = concat("https://", internal_name, ":", std::to_string(machine.port), path);
    request.address = machine.host;
    return request;
}

std::string authority_of(InternalAddress const& machine)
{
    auto const& host = machine.name.empty() ? machine.host : machine.name;
    bool const is_v6 = host.find(':') != std::string::npos;
    return concat(is_v6 ? "[" : "", host, is_v6 ? "]:" : ":", std::to_string(machine.port));
}

std::optional<NumericAddress> parse_numeric_address(std::string_view text)
{
    auto const colon = text.rfind(':');
    if (colon == std::string_view::npos)
        return std::nullopt;
    auto host = text.substr(0, colon);
    bool const has_brackets = host.starts_with('[') && host.ends_with(']');
    if (has_brackets)
        host = host.substr(1, host.size() - 2);
    auto const address = IpAddress::parse(host);
    NumericAddress parsed;
    parsed.port = parse_port(text.substr(colon + 1));
    if (!address || address->is_v4() == has_brackets || parsed.port == 0)
        return std::nullopt;
    parsed.host = host;
    return parsed;
}

std::optional<std::pair<std::uint16_t, std::uint16_t>> parse_port_range(std::string_view text)
{
    auto const dash = std::min(text.size(), text.find('-'));
    auto const first = parse_port(text.substr(0, dash));
    auto const last = dash == text.size() ? first : parse_port(text.substr(dash + 1));
    if (first == 0 || last < first)
        return std::nullopt;
    return std::pair(first, last);
}

std::optional<PortPath> split_port_path(std::string_view path) noexcept
{
    if (!path.starts_with('/'))
        return std::nullopt;
    auto const end = std::min(path.size(), path.find('/', 1));
    PortPath split;
    split.port = parse_port(path.substr(1, end - 1));
    if (split.port == 0)
        return std::nullopt;
    split.rest = end == path.size() ? std::string_view("/") : path.substr(end);
    return split;
}

bool is_operators_path(std::string_view path)
{
    // Our servers compare paths as they come. Others, and proxies in between, may tidy them up first.
    std::string decoded;
    if (!percent_decode(path, decoded))
        decoded = path;
    auto const is_operators = [](std::string_view segment) {
        return segment == "metrics" || segment == "api";
    };
    std::vector<std::string> segments;
    bool is_first = true;
    for (auto const segment : split(decoded, '/')) {
        if (segment.empty() || segment == ".")
            continue;
        if (std::exchange(is_first, false) && is_operators(lower_case(segment)))
            return true; // wherever it leads from there
        if (segment != "..")
            segments.push_back(lower_case(segment));
        else if (!segments.empty())
            segments.pop_back();
    }
    return !segments.empty() && is_operators(segments.front());
}

ForwardTarget target_at_machine(InternalAddress machine, bool is_trusted, std::string_view path,
                                std::string_view query)
{
    ForwardTarget target;
    target.machine = std::move(machine);
    target.target = query.empty() ? std::string(path) : concat(path, "?", query);
    target.kind = is_trusted && path == "/monitor" ? UpstreamKind::trusted_monitor : UpstreamKind::machine;
    target.is_trusted = is_trusted;
    return target;
}

std::uint16_t public_port(std::string_view address) noexcept
{
    auto const slash = address.rfind('/');
    return slash == std::string_view::npos ? 0 : parse_port(address.substr(slash + 1));
}

ForwardingTable::ForwardingTable(std::vector<ServerSpec> const& servers)
{
    for (auto const& server : servers)
        add(server);
}

void ForwardingTable::add(ServerSpec const& server)
{
    if (server.has_own_path || server.internal_address.empty())
        return;
    auto const machine = parse_internal_address(server.internal_address);
    auto const port = public_port(server.address);
    if (!machine || port == 0)
        return;
    Range range;
    range.first = range.last = port;
    range.machine = *machine;
    range.is_trusted = server.trusted;
    range.is_elsewhere = server.elsewhere;
    ranges_.push_back(range);
    if (server.first_port == 0)
        return;
    range.first = range.machine.port = server.first_port;
    range.last = server.last_port;
    range.is_of_simulators = true;
    ranges_.push_back(std::move(range));
}

/// One after the other: there are as many as machines, and each request of this kind opens a connection.
ForwardingTable::Range const* ForwardingTable::range_of(std::uint16_t port) const noexcept
{
    auto const found = std::find_if(ranges_.begin(), ranges_.end(), [port](Range const& range) {
        return range.first <= port && port <= range.last;
    });
    return found == ranges_.end() ? nullptr : &*found;
}

std::optional<ForwardTarget> ForwardingTable::find(std::string_view path, std::string_view query) const
{
    auto const split = split_port_path(path);
    auto const* const range = split ? range_of(split->port) : nullptr;
    if (!range || is_operators_path(split->rest))
        return std::nullopt;
    auto machine = range->machine;
    machine.port = static_cast<std::uint16_t>(machine.port + (split->port - range->first));
    auto target = target_at_machine(std::move(machine), range->is_trusted, split->rest, query);
    target.is_elsewhere = range->is_elsewhere;
    if (range->is_of_simulators)
        target.kind = UpstreamKind::simulation;
    return target;
}

} // namespace webots_cloud::core
