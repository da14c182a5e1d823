#include "gateway_address.hpp"

#include "core/base64.hpp"
#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view folder = "/simulation/";

/// Without the port or the path of a machine in front.
std::string_view path_at_machine(std::string_view path) noexcept
{
    constexpr std::string_view machines = "/machine/";
    auto const named = path.starts_with(machines) ? machines.size() : 1;
    auto const end =
        path.starts_with(machines) ? path.find('/', named) : path.find_first_not_of("0123456789", named);
    bool const is_in_front = path.starts_with('/') && end != std::string_view::npos && end > named;
    return is_in_front ? path.substr(end) : path;
}

} // namespace

std::optional<GatewayPath> parse_gateway_path(std::string_view path)
{
    if (!path.starts_with(folder))
        return std::nullopt;
    path.remove_prefix(folder.size());
    auto const token_end = path.find('/');
    if (token_end == std::string_view::npos)
        return std::nullopt;
    GatewayPath parsed;
    parsed.token = path.substr(0, token_end);
    path.remove_prefix(token_end + 1);
    auto const port_end = std::min(path.find('/'), path.size());
    parsed.port = parse_port(path.substr(0, port_end)); // no zeros before it: each simulation has one address
    if (!is_gateway_token(parsed.token) || parsed.port == 0)
        return std::nullopt;
    parsed.rest = port_end < path.size() ? path.substr(port_end) : "/";
    return parsed;
}

bool is_gateway_token(std::string_view token) noexcept
{
    return !token.empty() && std::all_of(token.begin(), token.end(), [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    });
}

std::string gateway_authority(std::string_view base, std::string_view token, std::uint16_t port)
{
    constexpr std::string_view end_of_scheme = "://";
    base.remove_prefix(base.find(end_of_scheme) + end_of_scheme.size());
    return concat(base, folder, token, "/", std::to_string(port));
}

std::string webots_gateway_message(std::string_view base, std::string_view token, std::uint16_t port)
{
    return concat("webots:", base, folder, token, "/", std::to_string(port));
}

bool is_gateway_path(std::string_view path) noexcept
{
    return path_at_machine(path).starts_with(folder);
}

bool is_path_of_key(std::string_view path) noexcept
{
    auto const at_machine = path_at_machine(path);
    return at_machine.starts_with(folder) || at_machine.starts_with(watch_folder);
}

std::string_view without_keys(std::string_view path) noexcept
{
    constexpr std::size_t shortest_key = 22; // 128 bits in base64url
    if (auto const found = path.find(folder); found != std::string_view::npos)
        path = path.substr(0, found + folder.size());
    for (std::size_t begin = 0; begin < path.size();) {
        begin = std::min(path.size(), path.find_first_of(base64url_digits, begin));
        auto const end = std::min(path.size(), path.find_first_not_of(base64url_digits, begin));
        if (end - begin >= shortest_key)
            return path.substr(0, begin);
        begin = end;
    }
    return path;
}

} // namespace webots_cloud::core
