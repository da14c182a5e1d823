// Finds out whether a server can use its folders and ports.
#include "places.hpp"

#include "app/simulation_folders.hpp"
#include "core/text.hpp"

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using asio::ip::tcp;
using core::Findings;

constexpr std::uint64_t gigabyte = std::uint64_t{1} << 30;
constexpr std::uint64_t wanted_for_session_logs = std::uint64_t{64} << 20;
// The logs of `make_simulation_logs`, half full.
constexpr std::uint64_t wanted_for_simulation_logs = gigabyte;
constexpr std::uint64_t wanted_for_projects = 2 * gigabyte; // of the largest one

boost::system::error_code try_port(tcp::endpoint const& where)
{
    asio::io_context context;
    tcp::acceptor acceptor(context);
    boost::system::error_code error;
    acceptor.open(where.protocol(), error);
    if (!error)
        acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error)
        acceptor.bind(where, error);
    if (!error)
        acceptor.listen(1, error);
    return error;
}

core::PortHolder holder_of(boost::system::error_code const& error)
{
    using core::PortHolder;
    if (!error)
        return PortHolder::nobody;
    if (error == asio::error::address_in_use)
        return PortHolder::other;
    if (error == asio::error::access_denied)
        return PortHolder::forbidden;
    if (error == boost::system::errc::address_not_available)
        return PortHolder::elsewhere;
    return PortHolder::unusable;
}

/// `key` names the port.
core::Finding port_finding(std::string_view key, std::string const& listen_address, std::uint16_t port,
                           bool is_running)
{
    if (is_running)
        return core::judge_port(key, port, core::PortHolder::this_server, {});
    boost::system::error_code error;
    auto address = asio::ip::make_address(listen_address, error);
    if (!error)
        error = try_port({address, port});
    if (error == asio::error::address_family_not_supported) // a machine without IPv6
        error = try_port({asio::ip::address_v4::any(), port});
    auto const holder = holder_of(error);
    return core::judge_port(key, port, holder,
                            holder == core::PortHolder::elsewhere ? listen_address : error.message());
}

} // namespace

std::vector<FolderUse> folders_of(SessionConfig const& config)
{
    return {
        FolderUse("logs", "\"logDir\"", config.log_dir / "session", wanted_for_session_logs, !config.debug)};
}

std::vector<FolderUse> folders_of(SimulationConfig const& config)
{
    auto const candidates = state_folders(config);
    return {FolderUse("state", "\"stateDir\"", candidates.front().path, wanted_for_projects,
                      candidates.size() == 1),
            FolderUse("cache", "XDG_CACHE_HOME", cache_folder(config, candidates.front().path),
                      wanted_for_projects, false),
            FolderUse("logs", "\"logDir\"", config.log_dir / "simulation", wanted_for_simulation_logs,
                      !config.debug)};
}

fs::path log_file_of(SessionConfig const& config)
{
    return config.debug ? fs::path() : config.log_dir / "session" / "output.log";
}

fs::path log_file_of(SimulationConfig const& config)
{
    return config.debug ? fs::path() : config.log_dir / "simulation" / "output.log";
}

bool has_open(fs::path const& file)
{
    constexpr rlim_t most = 65'536; // the log was opened before any browser came
    struct stat there
    {};
    struct stat ours
    {};
    rlimit limit{};
    if (::stat(file.c_str(), &there) != 0 || ::getrlimit(RLIMIT_NOFILE, &limit) != 0)
        return false;
    auto const last = static_cast<int>(std::min(limit.rlim_cur, most));
    for (int descriptor = 0; descriptor < last; ++descriptor)
        if (::fstat(descriptor, &ours) == 0 && ours.st_dev == there.st_dev && ours.st_ino == there.st_ino)
            return true;
    return false;
}

core::FolderReading read_folder(fs::path const& folder)
{
    core::FolderReading reading;
    std::error_code failed;
    reading.path = fs::absolute(folder, failed);
    auto there = reading.path;
    while (!fs::exists(there, failed) && there.has_relative_path())
        there = there.parent_path();
    reading.exists = there == reading.path;
    if (!fs::is_directory(there, failed))
        reading.problem = core::concat(there.string(), " is no folder");
    else if (::access(there.c_str(), W_OK | X_OK) != 0)
        reading.problem = std::system_category().message(errno);
    struct statvfs disk
    {};
    if (::statvfs(there.c_str(), &disk) != 0)
        return reading;
    reading.free = disk.f_bavail * disk.f_frsize;
    reading.total = disk.f_blocks * disk.f_frsize;
    reading.free_files = disk.f_favail;
    reading.total_files = disk.f_files;
    return reading;
}

Findings port_findings(std::uint16_t port, NetworkConfig const& network, bool is_running)
{
    Findings findings{port_finding("\"port\"", network.listen_address, port, is_running)};
    if (network.redirect_port != 0)
        findings.push_back(
            port_finding("\"redirectPort\"", network.listen_address, network.redirect_port, is_running));
    return findings;
}

Findings simulation_port_findings(SimulationConfig const& config)
{
    if (config.docker || config.slurm)
        return {};
    auto const port_after = [&config](int i) { return static_cast<std::uint16_t>(config.address.port + i); };
    int free = 0;
    for (int i = 1; i <= config.launching.max_simulations; ++i)
        free += try_port({asio::ip::address_v4::any(), port_after(i)}) ? 0 : 1;
    return {core::judge_simulation_ports(port_after(1), config.launching.max_simulations, free)};
}

Findings website_findings(SimulationConfig const& config)
{
    Findings findings;
    auto const require = [&findings](std::string_view key, fs::path const& folder, std::string_view effect) {
        std::error_code failed;
        fs::directory_iterator const look(folder, failed);
        if (failed)
            findings.emplace_back(core::Verdict::warning, core::concat("key \"", key, "\""),
                                  core::concat("the folder ", fs::absolute(folder).string(),
                                               " can't be read: ", failed.message()),
                                  effect);
    };
    if (config.docker)
        return findings;
    std::error_code ignored; // a folder that is missing is told by the configuration itself
    if (fs::is_directory(config.websites.projects, ignored))
        require("projectsDir", config.websites.projects, "Websites have no templates to start from.");
    if (config.websites.keys != SimulationConfig().websites.keys)
        require("keyDir", config.websites.keys, "Projects are fetched from websites without a key.");
    return findings;
}

} // namespace webots_cloud::app
