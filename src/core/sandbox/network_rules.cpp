#include "network_rules.hpp"

#include "core/access/public_networks.hpp"
#include "core/text.hpp"

namespace webots_cloud::core {

std::string internet_only_rules(std::vector<std::string> const& own)
{
    std::string rules;
    for (auto const network : non_public_networks)
        rules.append(concat("route replace unreachable ", network, "\n"));
    for (auto const& address : own)
        rules.append(concat("route replace unreachable ", address, "/32\n"));
    rules.append("rule add pref 10 to 10.0.2.3 ipproto 17 dport 53 lookup main\n"
                 "rule add pref 11 to 10.0.2.3 ipproto 6 dport 53 lookup main\n"
                 "rule add pref 12 to 10.0.2.3 unreachable\n");
    return rules;
}

} // namespace webots_cloud::core
