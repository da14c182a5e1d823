// What `--check-config` looks at besides the configuration's text and files.
#include "adapters/host/epoll_watches.hpp"
#include "app/daemon.hpp"
#include "checks.hpp"
#include "core/access/site_access.hpp"
#include "core/doctor/named_hosts.hpp"
#include "core/text.hpp"
#include "places.hpp"

#include <webots_cloud/adapters/host.hpp>
#include <webots_cloud/adapters/names.hpp>

#include <boost/asio/io_context.hpp>

#include <exception>
#include <type_traits>

namespace webots_cloud::app {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;
using core::Findings;
using core::Verdict;

constexpr auto limit = std::chrono::seconds(3); // of everything that is looked at, together

/// For faults that the server would start with.
Findings as_warnings(Findings findings)
{
    for (auto& each : findings)
        if (each.verdict == Verdict::fault)
            each.verdict = Verdict::warning;
    return findings;
}

CheckWork check_use(FolderUse use)
{
    auto const subject = use.key.starts_with('"') ? concat("key ", use.key) : use.key;
    auto const reading = co_await folder_reading(use.folder);
    Findings findings;
    if (reading) {
        bool const is_fatal = use.is_essential && !reading->problem.empty();
        Findings const found{core::judge_folder(subject, use.key, *reading, use.wanted)};
        findings = is_fatal ? found : as_warnings(found);
    }
    co_return findings;
}

CheckWork check_hosts(std::vector<core::NamedHost> hosts, NameService& names, Clock& clock)
{
    auto found = co_await check_names(std::move(hosts), names, clock, limit);
    co_return as_warnings(std::move(found));
}

/// A server that runs has its ports. It may be another user's, whose socket we can't see.
template<class Config>
Findings ports_of(Config const& config, std::string_view kind)
{
    bool const is_running = app::is_running(kind, config.address.port, config.access);
    auto findings = port_findings(config.address.port, config.network, is_running);
    if constexpr (std::is_same_v<Config, SimulationConfig>)
        if (!is_running)
            for (auto& each : simulation_port_findings(config))
                findings.push_back(std::move(each));
    return as_warnings(std::move(findings));
}

template<class Config>
result<> look_around(Configured<Config>& configured, fs::path const& origin, std::string_view kind)
{
    auto const& config = configured.config;
    // Without watches no event loop could wait for what is looked at below.
    if (auto const found = adapters::find_watches(); !found) {
        configured.warnings.push_back(concat(
            origin.string(), ": ports, folders and names were not looked at: ", found.error().message()));
        return {};
    }
    auto findings = ports_of(config, kind);
    if constexpr (std::is_same_v<Config, SimulationConfig>)
        for (auto& each : website_findings(config))
            findings.push_back(std::move(each));
    asio::io_context context;
    auto const clock = make_steady_clock(context.get_executor());
    auto const names = make_name_service(context.get_executor());
    // All at once, and within `limit`: somebody waits for the answer.
    std::vector<Check> checks;
    for (auto& use : folders_of(config)) {
        auto const subject = use.key;
        checks.emplace_back(subject, check_use(std::move(use)), limit);
    }
    checks.emplace_back("names", check_hosts(core::named_hosts(config), *names, *clock),
                        limit + std::chrono::seconds(1));
    run_to_end(examine(std::move(checks), *clock), context, findings);
    result<> usable;
    for (auto const& each : findings) {
        if (each.verdict == Verdict::ok)
            continue;
        auto const line = concat(origin.string(), ": ", each.subject, ": ", each.found, ". ",
                                 each.remedy.substr(0, each.remedy.size() - each.remedy.ends_with('.')));
        if (each.verdict == Verdict::warning)
            configured.warnings.push_back(line);
        else
            usable =
                Failure(errc::invalid_config, usable ? line : concat(usable.error().message(), "\n", line));
    }
    return usable;
}

/// Webots can write a page that people open from disk. On the Internet it may use any server.
void note_pages_from_disk(Configured<SessionConfig>& configured)
{
    auto const& config = configured.config;
    auto reach = core::reach_of(config.address.host);
    for (auto const& machine : config.simulation_servers)
        reach = core::wider(reach, core::reach_of(machine.address));
    if (reach != core::Reach::everybody && !config.access.allowed_origins)
        configured.notes.emplace_back(
            "Webots' own page is refused when it is opened from disk. To let such pages in, add this line: "
            R"("allowedOrigins": ["null", "https://webots.cloud"])");
}

} // namespace

result<> check_surroundings(Configured<SessionConfig>& configured, fs::path const& origin)
{
    note_pages_from_disk(configured);
    return look_around(configured, origin, "session");
}

result<> check_surroundings(Configured<SimulationConfig>& configured, fs::path const& origin)
{
    return look_around(configured, origin, "simulation");
}

} // namespace webots_cloud::app
