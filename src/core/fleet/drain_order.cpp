#include "drain_order.hpp"

#include "core/text.hpp"

namespace webots_cloud::core {

std::optional<DrainOrder> parse_drain_order(std::string_view query)
{
    constexpr std::string_view machine = "machine=";
    DrainOrder order;
    for (auto const part : split(query, '&')) {
        if (part == "off" && !order.off)
            order.off = true;
        else if (!part.starts_with(machine) || !order.machine.empty() ||
                 !percent_decode(part.substr(machine.size()), order.machine))
            return std::nullopt;
    }
    if (order.machine.empty())
        return std::nullopt;
    return order;
}

} // namespace webots_cloud::core
