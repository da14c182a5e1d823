// What both doctors look at.
#pragma once

#include "app/daemon.hpp"
#include "core/doctor/finding.hpp"
#include "core/doctor/named_hosts.hpp"
#include "examination.hpp"
#include "places.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http_client.hpp>
#include <webots_cloud/transport/name_service.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace webots_cloud::app {

/// How long others have to answer, so that what is said of them is more than that a check took too long.
inline constexpr Duration answer_limit = std::chrono::seconds(5);
/// For checks that start one program after the other, on machines that have much to do.
inline constexpr Duration trial_limit = std::chrono::seconds(9);

using CheckWork = boost::asio::awaitable<core::Findings>;

/// Who looks.
struct Viewpoint
{
    Viewpoint() = default;

    bool is_running = false;      ///< A server with this configuration runs, this one perhaps.
    bool is_server = false;       ///< It is the server itself, which starts no programs for this.
    std::string instance;         ///< What the server calls itself; empty: it has to be asked,
    std::filesystem::path socket; ///< at this socket of the operator.
};

/// The view of the server itself, which calls itself so.
Viewpoint view_from_inside(std::string instance);

/// Whether somebody listens on the operator's socket of a server with this configuration.
bool is_running(std::string_view kind, std::uint16_t port, AccessConfig const& access);

/// What the server that runs calls itself; empty: it does not say, being an older one, or not to this user.
/// Blocks.   Errors: `timed_out`: it hangs.
result<std::string> ask_instance(std::filesystem::path const& socket);

/// The view of another program.
Viewpoint view_from_outside(std::string_view kind, std::uint16_t port, AccessConfig const& access);

/// Memory, clock and open files. `memory` and `files`: what the server may want of them.
core::Findings machine_findings(std::uint64_t memory, std::uint64_t files);

/// What root sees and a service may not: memory, clock and firewall.
CheckWork findings_of_root(std::uint64_t memory, std::uint16_t port);

/// What `read_folder` reads, on a thread of its own.
boost::asio::awaitable<result<core::FolderReading>> folder_reading(std::filesystem::path folder);

/// What both servers have: folders, log, certificate, firewall, name and public address. `log`: its file;
/// empty: there is none. Lifetime: `http` and `names` outlive the checks.
std::vector<Check> common_checks(std::vector<FolderUse> const& folders, std::filesystem::path const& log,
                                 NetworkConfig const& network, PublicAddress const& address,
                                 Viewpoint const& viewpoint, HttpClient& http, NameService& names);

/// Those of many names that are not found, all looked up within `limit`; nothing where all are.
CheckWork check_names(std::vector<core::NamedHost> hosts, NameService& names, Clock& clock, Duration limit);

/// What `program_output` says, on a thread of its own; `command` begins with the name of a program.
/// Errors: `not_found`: there is no such program.
boost::asio::awaitable<result<std::string>> output_of(std::vector<std::string> command);

/// Whether this program can wait for anything (`find_watches`). If not, that is a finding, and nothing else
/// may be looked at.
bool can_wait(core::Findings& findings);

/// Reads the configuration, whose faults and warnings are findings; nothing: the faults keep the server from
/// starting at all.
template<class Config>
std::optional<Config> read_for_doctor(Arguments const& arguments,
                                      result<Configured<Config>> (*parse)(std::string_view,
                                                                          std::filesystem::path const&),
                                      core::Findings& findings)
{
    using core::Verdict;
    constexpr auto subject = "configuration";
    auto configured = read_config(arguments, parse);
    if (!configured) {
        findings.emplace_back(Verdict::fault, subject, configured.error().message(),
                              "Correct it: the server does not start with it.");
        return std::nullopt;
    }
    auto const config = configured->config;
    configured->config.network.ssl_certificate.clear(); // it has a check of its own
    if (auto const usable = check_files(*configured, arguments.config); !usable)
        findings.emplace_back(Verdict::fault, subject, usable.error().message(),
                              "Correct it: the server does not start with it.");
    for (auto const& warning : configured->warnings)
        findings.emplace_back(Verdict::warning, subject, warning);
    if (findings.empty())
        findings.emplace_back(Verdict::ok, subject, arguments.config.string());
    return config;
}

} // namespace webots_cloud::app
