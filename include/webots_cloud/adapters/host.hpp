// This computer: its clock, addresses, service manager and load.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/host_metrics.hpp>
#include <webots_cloud/transport/service_manager.hpp>

#include <boost/asio/any_io_executor.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// The clock of this computer.
std::unique_ptr<Clock> make_steady_clock(boost::asio::any_io_executor executor);

/// The IPv4 addresses of this computer, loopback included, each once.
std::vector<std::string> own_ipv4_addresses();

/// The same of IPv6.
std::vector<std::string> own_ipv6_addresses();

/// The IPv4 addresses where the other machines of our networks find this computer.
std::vector<std::string> shared_ipv4_addresses();

/// The service manager that the environment names (`NOTIFY_SOCKET`, `WATCHDOG_USEC`), as systemd does;
/// without one it hears nothing.
std::unique_ptr<ServiceManager> make_service_manager();

/// Where the state of this computer is found.
struct HostMetricsParams
{
    HostMetricsParams() = default;

    std::filesystem::path control_groups = "/sys/fs/cgroup";       ///< Where they are mounted.
    std::filesystem::path own_control_group = "/proc/self/cgroup"; ///< The file that names ours.
    std::string nvidia_library = "libnvidia-ml.so.1";              ///< Loaded if there is one.
};

/// This computer, as `/proc`, control groups and the NVIDIA library describe it. With that library it may
/// take three seconds to make.
std::unique_ptr<HostMetrics> make_host_metrics(HostMetricsParams params = HostMetricsParams());

} // namespace webots_cloud
