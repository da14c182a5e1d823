#include "checks.hpp"

#include "app/operator_requests.hpp"
#include "aside.hpp"
#include "core/doctor/machine_findings.hpp"
#include "core/doctor/network_findings.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"
#include "doctor_endpoint.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/probes.hpp>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include <sys/resource.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <set>
#include <system_error>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;

namespace {

using asio::ip::tcp;
using core::concat;
using core::Findings;

constexpr std::size_t max_output = 1 << 20; // of a command

/// A line of /proc/meminfo, in bytes.
std::uint64_t memory_figure(std::string const& name)
{
    std::ifstream file("/proc/meminfo");
    std::string word;
    for (std::uint64_t kilobytes = 0; file >> word;)
        if (word == name && file >> kilobytes)
            return kilobytes * 1024;
    return 0;
}

bool is_clock_synchronised()
{
    ::timex state{};
    return ::adjtimex(&state) != TIME_ERROR || (state.status & STA_UNSYNC) == 0;
}

/// Blocks where a network drive hangs.
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
        reading.problem = concat(there.string(), " is no folder");
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

/// A name, or a numeric address, without a port; empty: any.
std::string host_of(PublicAddress const& address)
{
    if (address.host == "*")
        return {};
    bool const has_port = address.host.find(':') == address.host.rfind(':');
    return has_port ? address.host.substr(0, address.host.find(':')) : address.host;
}

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

result<std::string> run_command(std::string const& command)
{
    auto* const pipe = ::popen(concat("timeout 6 ", command, " 2>&1").c_str(), "re");
    if (!pipe)
        return Failure(errc::unavailable, std::system_category().message(errno));
    std::string output;
    char buffer[4096];
    for (std::size_t size = 0; (size = std::fread(buffer, 1, sizeof buffer, pipe)) > 0;)
        if (output.size() < max_output)
            output.append(buffer, size);
    if (::pclose(pipe) != 0)
        return Failure(errc::unavailable, core::printable(core::trim(output), 300));
    return output;
}

/// `key` names the port.
core::Finding port_finding(std::string_view key, std::string const& listen_address, std::uint16_t port,
                           bool is_running)
{
    using core::PortHolder;
    if (is_running)
        return core::judge_port(key, port, PortHolder::this_server, {});
    boost::system::error_code error;
    auto address = asio::ip::make_address(listen_address, error);
    if (!error)
        error = try_port({address, port});
    if (error == asio::error::address_family_not_supported) // a machine without IPv6
        error = try_port({asio::ip::address_v4::any(), port});
    auto const holder = !error                                 ? PortHolder::nobody
                        : error == asio::error::address_in_use ? PortHolder::other
                                                               : PortHolder::unusable;
    return core::judge_port(key, port, holder, error.message());
}

} // namespace

Findings machine_findings(std::uint64_t memory, std::uint64_t files)
{
    rlimit limit{};
    ::getrlimit(RLIMIT_NOFILE, &limit);
    return {core::judge_memory(memory_figure("MemAvailable:"), memory_figure("MemTotal:"), memory),
            core::judge_clock(is_clock_synchronised()), core::judge_open_files(limit.rlim_max, files)};
}

CheckWork check_folder(std::string subject, std::string key, fs::path folder, std::uint64_t wanted)
{
    std::function<result<core::FolderReading>()> const look = [folder = std::move(folder)] {
        return result<core::FolderReading>(read_folder(folder));
    };
    auto const reading = co_await aside<core::FolderReading>(look);
    Findings findings;
    if (reading)
        findings.push_back(core::judge_folder(subject, key, *reading, wanted));
    co_return findings;
}

CheckWork check_server_certificate(NetworkConfig network, PublicAddress address)
{
    Findings findings;
    if (network.ssl_certificate.empty())
        co_return findings;
    auto const host = host_of(address);
    std::function<result<Findings>()> const look = [network = std::move(network), host] {
        auto const pair = check_certificate(network.ssl_certificate, network.ssl_key);
        auto const facts = read_certificate(network.ssl_certificate, host);
        return result<Findings>(
            Findings{core::judge_certificate(pair, facts, host, std::chrono::system_clock::now())});
    };
    auto found = co_await aside<Findings>(look);
    if (found)
        findings = std::move(*found);
    co_return findings;
}

Findings port_findings(std::uint16_t port, NetworkConfig const& network, bool is_running)
{
    Findings findings{port_finding("\"port\"", network.listen_address, port, is_running)};
    if (network.redirect_port != 0)
        findings.push_back(
            port_finding("\"redirectPort\"", network.listen_address, network.redirect_port, is_running));
    return findings;
}

bool is_free(std::uint16_t port)
{
    return !try_port({asio::ip::address_v4::any(), port});
}

asio::awaitable<result<std::string>> output_of(std::string command)
{
    std::function<result<std::string>()> const run = [command = std::move(command)] {
        return run_command(command);
    };
    auto output = co_await aside<std::string>(run);
    co_return output;
}

CheckWork check_firewall(std::uint16_t port)
{
    core::FirewallReading reading;
    for (std::string const command : {"/usr/sbin/nft list ruleset", "/usr/sbin/iptables -S"}) {
        auto const rules = co_await output_of(command);
        if (!rules)
            continue;
        auto const found = core::parse_firewall(*rules, port);
        reading.can_be_seen = true;
        reading.drops_by_default = reading.drops_by_default || found.drops_by_default;
        reading.names_port = reading.names_port || found.names_port;
    }
    Findings findings{core::judge_firewall(reading, port)};
    co_return findings;
}

CheckWork check_name(PublicAddress address)
{
    Findings findings;
    auto const host = host_of(address);
    if (host.empty())
        co_return findings;
    std::function<result<std::size_t>()> const look = [host]() -> result<std::size_t> {
        asio::io_context context;
        boost::system::error_code error;
        auto const found = tcp::resolver(context).resolve(host, "", error);
        std::set<asio::ip::address> addresses;
        for (auto const& entry : found)
            addresses.insert(entry.endpoint().address());
        return error ? result<std::size_t>(Failure(error)) : addresses.size();
    };
    auto const addresses = co_await aside<std::size_t>(look);
    findings.push_back(core::judge_name(host, addresses));
    co_return findings;
}

CheckWork check_public_address(HttpClient& http, PublicAddress address, Viewpoint viewpoint)
{
    Findings findings;
    auto const* const reason = !viewpoint.is_running        ? "the server does not run"
                               : address.host == "*"        ? "browsers may use any name of this machine"
                               : viewpoint.instance.empty() ? "the server that runs is an older one"
                                                            : nullptr;
    if (reason) {
        findings.emplace_back(core::Verdict::ok, "public address", concat("not looked at: ", reason));
        co_return findings;
    }
    HttpRequest request(concat(core::public_http_url(address), "/livez"));
    request.timeout = answer_limit;
    auto const url = request.url;
    auto const answer = co_await http.send(std::move(request));
    result<core::PublicReading> reading = core::PublicReading();
    if (!answer) {
        reading = answer.error();
    } else {
        reading->url = url;
        reading->status = answer->status;
        reading->own_instance = std::move(viewpoint.instance);
        for (auto const& [name, value] : answer->headers)
            if (equal_ignoring_case(name, instance_header))
                reading->instance = value;
    }
    findings.push_back(core::judge_public_address(reading, url));
    co_return findings;
}

Viewpoint view_from_inside(std::string instance)
{
    Viewpoint viewpoint;
    viewpoint.is_running = true;
    viewpoint.instance = std::move(instance);
    viewpoint.is_server = true;
    return viewpoint;
}

Viewpoint view_from_outside(std::string_view kind, std::uint16_t port, AccessConfig const& access)
{
    auto const socket = find_operator_socket(kind, port, access);
    Viewpoint viewpoint;
    viewpoint.is_running = ask_operator_socket(socket, "GET", "/livez").has_value();
    if (!viewpoint.is_running)
        return viewpoint;
    auto const answer = ask_operator_socket(socket, "GET", "/api/doctor?last");
    boost::json::error_code error;
    auto const said = answer ? boost::json::parse(*answer, error) : boost::json::value();
    if (auto const* const all = said.if_object())
        if (auto const* const instance = all->if_contains("instance"); instance && instance->is_string())
            viewpoint.instance = instance->get_string();
    return viewpoint;
}

void report_findings(Arguments const& arguments, Findings findings,
                     std::function<asio::awaitable<Findings>(asio::any_io_executor)> look)
{
    if (look) {
        asio::io_context context;
        auto const take = [&findings](std::exception_ptr failure, Findings const& found) {
            if (failure)
                std::rethrow_exception(failure);
            findings.insert(findings.end(), found.begin(), found.end());
        };
        asio::co_spawn(context, look(context.get_executor()), take);
        context.run();
    }
    bool const coloured = ::isatty(STDOUT_FILENO) == 1 && !std::getenv("NO_COLOR");
    std::cout << (arguments.json ? core::findings_json(findings) + "\n"
                                 : core::findings_text(findings, coloured))
              << std::flush;
    // Threads may still be at work (aside.hpp): nothing is torn down below them.
    std::quick_exit(static_cast<int>(core::worst(findings)));
}

Progress shown_progress()
{
    if (::isatty(STDERR_FILENO) != 1)
        return {};
    return [](std::vector<std::string> const& subjects) {
        std::cerr << "\r\x1b[K";
        if (!subjects.empty())
            std::cerr << "Looking at " << core::join({subjects.begin(), subjects.end()}, ", ") << " ...\r";
        std::cerr << std::flush;
    };
}

} // namespace webots_cloud::app
