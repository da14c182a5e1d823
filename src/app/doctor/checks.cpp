// What both doctors look at: memory, clock, folders, certificate, firewall, name and public address. A check
// asks (this file) and has what it got judged (core/doctor), so that each sentence has a test. Whatever may
// hang, a network drive or a name server, is asked on a thread of its own (aside.hpp) or with a deadline.
#include "checks.hpp"

#include "adapters/host/epoll_watches.hpp"
#include "adapters/operator/operator_socket.hpp"
#include "adapters/process/program_output.hpp"
#include "app/certificate_finding.hpp"
#include "app/environment.hpp"
#include "app/operator_requests.hpp"
#include "aside.hpp"
#include "core/doctor/machine_findings.hpp"
#include "core/doctor/network_findings.hpp"
#include "core/simulation/client_protocol.hpp"
#include "core/text.hpp"
#include "doctor_endpoint.hpp"
#include "service_view.hpp"

#include <webots_cloud/adapters/http_server.hpp>

#include <boost/asio/experimental/awaitable_operators.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/json/parse.hpp>
#include <boost/json/value.hpp>

#include <sys/resource.h>
#include <sys/timex.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <system_error>
#include <thread>

namespace webots_cloud::app {
namespace asio = boost::asio;
namespace fs = std::filesystem;
using namespace asio::experimental::awaitable_operators;

namespace {

using core::concat;
using core::Findings;

constexpr std::size_t max_lookups = 64;    // at a time: name servers may limit how many they answer
constexpr std::size_t max_names_told = 10; // that are not found
constexpr auto name_remedy = "Check /etc/resolv.conf, and the name servers in it.";

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

/// Names that are being looked up.
struct Lookups
{
    std::vector<core::NamedHost> hosts;
    TimePoint deadline;
    std::size_t begun = 0;
    std::size_t answered = 0;
    std::map<std::size_t, Failure> missing;
};

asio::awaitable<void> look_up(Lookups& all, NameService& names, Clock& clock)
{
    while (all.begun < all.hosts.size() && clock.now() < all.deadline) {
        auto const index = all.begun++;
        auto const addresses = co_await names.addresses(all.hosts[index].name, all.deadline);
        if (!addresses && clock.now() >= all.deadline)
            co_return;
        if (!addresses)
            all.missing.emplace(index, addresses.error());
        ++all.answered;
    }
}

asio::awaitable<void> look_up_side_by_side(Lookups& all, NameService& names, Clock& clock, std::size_t count)
{
    if (count > 0)
        co_await (look_up(all, names, clock) && look_up_side_by_side(all, names, clock, count - 1));
}

Findings names_found_out(Lookups const& all)
{
    Findings findings;
    for (auto const& [index, failure] : all.missing) {
        if (findings.size() == max_names_told) {
            auto const others = all.missing.size() - max_names_told;
            findings.emplace_back(core::Verdict::fault, "names",
                                  concat(std::to_string(others), " more are not found"), name_remedy);
            break;
        }
        auto finding = core::judge_name(all.hosts[index].name, failure);
        finding.subject = concat("key \"", all.hosts[index].key, "\"");
        findings.push_back(std::move(finding));
    }
    if (all.answered < all.hosts.size())
        findings.emplace_back(core::Verdict::warning, "names",
                              concat("no name server has answered in time for ",
                                     std::to_string(all.hosts.size() - all.answered), " of ",
                                     std::to_string(all.hosts.size()), " names"),
                              name_remedy);
    return findings;
}

} // namespace

Findings machine_findings(std::uint64_t memory, std::uint64_t files)
{
    rlimit limit{};
    ::getrlimit(RLIMIT_NOFILE, &limit);
    return {core::judge_memory(memory_figure("MemAvailable:"), memory_figure("MemTotal:"), memory),
            core::judge_clock(is_clock_synchronised()), core::judge_open_files(limit.rlim_max, files)};
}

asio::awaitable<result<core::FolderReading>> folder_reading(fs::path folder)
{
    std::function<result<core::FolderReading>()> const look = [folder = std::move(folder)] {
        return result<core::FolderReading>(read_folder(folder));
    };
    auto reading = co_await aside<core::FolderReading>(look);
    co_return reading;
}

namespace {

CheckWork check_folder(FolderUse use)
{
    auto const reading = co_await folder_reading(use.folder);
    Findings findings;
    if (reading) {
        auto& finding = findings.emplace_back(core::judge_folder(use.subject, use.key, *reading, use.wanted));
        if (!use.is_essential && !reading->problem.empty()) // the server does without, or uses another one
            finding.verdict = core::Verdict::warning;
    }
    co_return findings;
}

CheckWork check_server_certificate(NetworkConfig network, PublicAddress address)
{
    Findings findings;
    if (network.ssl_certificate.empty())
        co_return findings;
    std::function<result<Findings>()> const look = [network = std::move(network),
                                                    address = std::move(address)] {
        return result<Findings>(Findings{find_certificate_faults(network, address).finding});
    };
    auto found = co_await aside<Findings>(look);
    if (found)
        findings = std::move(*found);
    co_return findings;
}

} // namespace

asio::awaitable<result<std::string>> output_of(std::vector<std::string> command)
{
    auto const program = find_system_program(command.front());
    if (program.empty())
        co_return Failure(errc::not_found, concat("there is no program ", command.front()));
    command.front() = program.string();
    std::function<result<std::string>()> const run = [command = std::move(command)] {
        return adapters::program_output(command, answer_limit);
    };
    auto output = co_await aside<std::string>(run);
    co_return output;
}

namespace {

/// What filters the packets that come in.
CheckWork check_firewall(std::uint16_t port)
{
    std::vector<std::string> nft{"nft", "list", "ruleset"};
    std::vector<std::string> iptables{"iptables", "-S"};
    auto const [tables, chains] = co_await (output_of(std::move(nft)) && output_of(std::move(iptables)));
    core::FirewallReading reading;
    for (auto const* const rules : {&tables, &chains}) {
        if (!*rules)
            continue;
        auto const found = core::parse_firewall(**rules, port);
        reading.can_be_seen = true;
        reading.drops_by_default = reading.drops_by_default || found.drops_by_default;
        reading.names_port = reading.names_port || found.names_port;
    }
    Findings findings{core::judge_firewall(reading, port)};
    co_return findings;
}

} // namespace

CheckWork findings_of_root(std::uint64_t memory, std::uint16_t port)
{
    Findings findings{core::judge_memory(memory_figure("MemAvailable:"), memory_figure("MemTotal:"), memory),
                      core::judge_clock(is_clock_synchronised())};
    auto const firewall = co_await check_firewall(port);
    findings.insert(findings.end(), firewall.begin(), firewall.end());
    co_return findings;
}

namespace {

/// Whether the name that browsers know the server by is found.
CheckWork check_name(NameService& names, PublicAddress address)
{
    Findings findings;
    if (address.host == "*") // any name
        co_return findings;
    std::string const host(core::host_in(address.host));
    auto const answer = co_await names.addresses(host, std::chrono::steady_clock::now() + answer_limit);
    findings.push_back(core::judge_name(host, answer ? result<std::size_t>(answer->addresses.size())
                                                     : result<std::size_t>(answer.error())));
    co_return findings;
}

} // namespace

result<std::string> ask_instance(fs::path const& socket)
{
    auto const answer = adapters::ask_operator_socket(socket, "GET", "/api/doctor?last");
    if (!answer)
        return answer.error() == errc::timed_out ? result<std::string>(answer.error()) : std::string();
    boost::json::error_code error;
    auto const said = boost::json::parse(*answer, error);
    auto const* const all = said.if_object();
    auto const* const instance = all ? all->if_contains("instance") : nullptr;
    return instance && instance->is_string() ? std::string(instance->get_string()) : std::string();
}

namespace {

/// What a server that runs has found out about its own log; nothing where it does not say in time.
Findings told_of_log(fs::path const& socket)
{
    constexpr std::string_view looks = "\"underWay\":true";
    auto const deadline = std::chrono::steady_clock::now() + answer_limit;
    auto answer = adapters::ask_operator_socket(socket, "GET", "/api/doctor");
    while (answer && answer->find(looks) != std::string::npos &&
           std::chrono::steady_clock::now() < deadline) {
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
        answer = adapters::ask_operator_socket(socket, "GET", "/api/doctor?last");
    }
    auto findings = answer ? core::parse_findings(*answer) : result<Findings>(answer.error());
    if (!findings)
        return {};
    std::erase_if(*findings,
                  [](core::Finding const& each) { return each.subject != core::lost_log_subject; });
    return std::move(*findings);
}

/// Whether the server writes to the log that people look at. Only it knows what it has open.
CheckWork check_log(Viewpoint viewpoint, fs::path log)
{
    Findings findings;
    if (!viewpoint.is_running || log.empty())
        co_return findings;
    std::function<result<Findings>()> const look = [viewpoint = std::move(viewpoint), log = std::move(log)] {
        std::error_code failed;
        if (!viewpoint.is_server)
            return result<Findings>(told_of_log(viewpoint.socket));
        return result<Findings>(
            has_open(log) ? Findings() : Findings{core::judge_lost_log(fs::absolute(log, failed).string())});
    };
    auto found = co_await aside<Findings>(look);
    if (found)
        findings = std::move(*found);
    co_return findings;
}

/// Whether the public address leads to the server that runs here.
CheckWork check_public_address(HttpClient& http, PublicAddress address, Viewpoint viewpoint)
{
    constexpr auto subject = "public address";
    Findings findings;
    // The server has made up a word at its start, which it tells here, and with each answer of /livez. Where
    // the public address answers with another one, or none, some other program is there.
    if (viewpoint.is_running && viewpoint.instance.empty()) {
        std::function<result<std::string>()> const ask = [socket = viewpoint.socket] {
            return ask_instance(socket);
        };
        auto const instance = co_await aside<std::string>(ask);
        if (!instance) {
            findings.emplace_back(
                core::Verdict::fault, subject,
                concat("not looked at, since the server hangs: ", instance.error().message()),
                "See the end of its log, and restart it.");
            co_return findings;
        }
        viewpoint.instance = *instance;
    }
    auto const* const reason = !viewpoint.is_running        ? "the server does not run"
                               : address.host == "*"        ? "browsers may use any name of this machine"
                               : viewpoint.instance.empty() ? "the server that runs is an older one"
                                                            : nullptr;
    if (reason) {
        findings.emplace_back(core::Verdict::ok, subject, concat("not looked at: ", reason));
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

} // namespace

CheckWork check_names(std::vector<core::NamedHost> hosts, NameService& names, Clock& clock, Duration limit)
{
    Lookups lookups;
    lookups.hosts = std::move(hosts);
    lookups.deadline = clock.now() + limit;
    co_await look_up_side_by_side(lookups, names, clock, std::min(max_lookups, lookups.hosts.size()));
    co_return names_found_out(lookups);
}

std::vector<Check> common_checks(std::vector<FolderUse> const& folders, fs::path const& log,
                                 NetworkConfig const& network, PublicAddress const& address,
                                 Viewpoint const& viewpoint, HttpClient& http, NameService& names)
{
    std::vector<Check> checks;
    for (auto const& use : folders)
        checks.emplace_back(use.subject, check_folder(use));
    checks.emplace_back("log", check_log(viewpoint, log));
    checks.emplace_back("certificate", check_server_certificate(network, address));
    if (!viewpoint.is_server)
        checks.emplace_back("firewall", check_firewall(address.port));
    checks.emplace_back("name server", check_name(names, address));
    checks.emplace_back("public address", check_public_address(http, address, viewpoint));
    return checks;
}

Viewpoint view_from_inside(std::string instance)
{
    Viewpoint viewpoint;
    viewpoint.is_running = true;
    viewpoint.instance = std::move(instance);
    viewpoint.is_server = true;
    return viewpoint;
}

bool is_running(std::string_view kind, std::uint16_t port, AccessConfig const& access)
{
    using asio::local::stream_protocol;
    auto const path = find_operator_socket(kind, port, access).string();
    asio::io_context context;
    stream_protocol::socket socket(context);
    boost::system::error_code failed;
    if (path.size() >= sizeof(sockaddr_un::sun_path) || socket.open(stream_protocol(), failed))
        return false;
    socket.non_blocking(true, failed); // one that hangs may accept nobody
    socket.connect(stream_protocol::endpoint(path), failed);
    return !failed || failed == asio::error::would_block;
}

Viewpoint view_from_outside(std::string_view kind, std::uint16_t port, AccessConfig const& access)
{
    Viewpoint viewpoint;
    viewpoint.instance = instance_told_by_root();
    viewpoint.is_running = !viewpoint.instance.empty() || is_running(kind, port, access);
    viewpoint.socket = find_operator_socket(kind, port, access);
    return viewpoint;
}

bool can_wait(Findings& findings)
{
    auto const found = adapters::find_watches();
    if (!found)
        findings.emplace_back(core::Verdict::fault, "epoll watches", found.error().message(),
                              "Nothing else was looked at: run the doctor again then.");
    return bool(found);
}

} // namespace webots_cloud::app
