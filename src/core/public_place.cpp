#include "public_place.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::size_t longest_path = 100;

bool is_plain_segment(std::string_view segment) noexcept
{
    auto const is_plain = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
               c == '_' || c == '.' || c == '~';
    };
    return !segment.empty() && segment != "." && segment != ".." &&
           std::all_of(segment.begin(), segment.end(), is_plain);
}

} // namespace

bool is_site_path(std::string_view text) noexcept
{
    if (text.size() > longest_path || !text.starts_with('/'))
        return false;
    while (!text.empty()) {
        text.remove_prefix(1);
        auto const end = std::min(text.size(), text.find('/'));
        if (!is_plain_segment(text.substr(0, end)))
            return false;
        text.remove_prefix(end);
    }
    return true;
}

bool is_machine_path(std::string_view text) noexcept
{
    auto const last = text.substr(text.rfind('/') + 1);
    bool const is_number = last.find_first_not_of("0123456789") == std::string_view::npos;
    return is_site_path(text) && (!is_number || parse_port(last) != 0);
}

std::string_view path_in(std::string_view name) noexcept
{
    auto const slash = name.find('/');
    return slash == std::string_view::npos ? std::string_view() : name.substr(slash);
}

std::string public_place(PublicAddress const& address)
{
    return address.path.empty() ? public_place(address, address.port) : concat(address.host, address.path);
}

std::string public_place(PublicAddress const& address, std::uint16_t port)
{
    bool const is_in_path = address.port_rewrite || !address.path.empty();
    return concat(address.host, address.path, is_in_path ? "/" : ":", std::to_string(port));
}

} // namespace webots_cloud::core
