// Looks up the names of machines.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/name_service.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <memory>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// Names of `/etc/hosts` and DNS, by c-ares. `servers`: who is asked instead of those of `/etc/resolv.conf`:
/// numeric addresses, with a port or without.
std::unique_ptr<NameService> make_name_service(boost::asio::any_io_executor executor,
                                               std::vector<std::string> const& servers = {});

} // namespace webots_cloud
