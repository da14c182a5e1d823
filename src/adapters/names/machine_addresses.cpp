#include "machine_addresses.hpp"

#include "core/access/ip_address.hpp"
#include "core/discovery/machine_name.hpp"
#include "core/text.hpp"

#include <cstddef>
#include <vector>

namespace webots_cloud::adapters {
namespace {

constexpr std::size_t max_shown_name = 100;

bool is_no_machine(boost::asio::ip::address const& found)
{
    auto const address = core::IpAddress::parse(found.to_string());
    return !address || !core::is_machine_address(*address, false);
}

} // namespace

result<> keep_those_elsewhere(Addresses& addresses, std::string_view name)
{
    if (std::erase_if(addresses, is_no_machine) == 0 || !addresses.empty())
        return {};
    return Failure(errc::unreachable, core::concat(core::printable(name, max_shown_name),
                                                   " leads to this machine itself, or to none "
                                                   "(\"discoverLoopback\" allows the former)"));
}

} // namespace webots_cloud::adapters
