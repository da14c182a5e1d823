#include "quota_levels.hpp"

#include "core/text.hpp"
#include "ip_address.hpp"

namespace webots_cloud::core {
namespace {

struct Wider
{
    int bits;
    std::string_view suffix;
    std::size_t factor;
};
constexpr std::array wider_networks{Wider{56, "/56", 2}, Wider{48, "/48", 4}};

/// Global unicast, which providers give to subscribers. Private networks are one's own.
bool is_global(IpAddress const& address) noexcept
{
    return (address.bytes().front() & 0xe0) == 0x20;
}

} // namespace

void QuotaLevels::add_wider(std::string_view network)
{
    static_assert(wider == wider_networks.size());
    auto const address = IpAddress::parse(network);
    if (!address || !is_global(*address))
        return;
    for (auto const& each : wider_networks) {
        auto& name = names_[size_ - 1];
        auto const text = concat(address->network(each.bits).text(), each.suffix);
        levels_[size_].key = {name.data(), text.copy(name.data(), name.size())};
        levels_[size_].factor = each.factor;
        ++size_;
    }
}

} // namespace webots_cloud::core
