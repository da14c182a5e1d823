#include "service_view.hpp"

#include "adapters/process/program_output.hpp"
#include "app/environment.hpp"
#include "checks.hpp"
#include "core/doctor/service_unit.hpp"
#include "core/text.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <string>
#include <system_error>
#include <vector>

namespace webots_cloud::app {
namespace fs = std::filesystem;

namespace {

using core::concat;
using core::Verdict;

constexpr auto mark = "WEBOTS_CLOUD_DOCTOR_FOR_ROOT";
constexpr auto told_instance = "WEBOTS_CLOUD_DOCTOR_INSTANCE";
constexpr auto systemd_limit = std::chrono::seconds(5);
constexpr auto doctor_limit = std::chrono::seconds(45); // it takes thirty at most, and has to be started
constexpr std::string_view runtime_folder = "webots-cloud/doctor"; // that of the service is the service's
// Root sees more of these: the firewall, and the parts of /proc that units hide.
constexpr std::string_view seen_by_root_alone[] = {"clock", "firewall", "memory"};

bool is_same_file(fs::path const& one, fs::path const& other)
{
    std::error_code failed;
    return fs::weakly_canonical(one, failed) == fs::weakly_canonical(other, failed);
}

bool has_configuration(core::ServiceUnit const& unit, fs::path const& config)
{
    auto const words = core::split(unit.command, ' ');
    return std::ranges::any_of(words, [&config](auto word) { return is_same_file(word, config); });
}

std::vector<std::string> doctor_command(fs::path const& systemd_run, core::ServiceUnit const& unit,
                                        fs::path const& config, std::string_view instance)
{
    std::error_code failed;
    auto const program = fs::read_symlink("/proc/self/exe", failed);
    std::vector<std::string> command{systemd_run.string(),
                                     "--quiet",
                                     "--collect",
                                     "--wait",
                                     "--pipe",
                                     concat("--setenv=", mark, "=1"),
                                     concat("--setenv=", told_instance, "=", instance)};
    for (auto const& setting : unit.settings)
        command.push_back(concat("--property=", setting));
    // The service has root make users for its simulations before it starts. The doctor gets its own, and
    // leaves those of the service alone.
    if (unit.pins_users) {
        auto const guard = program.parent_path() / "webots-process-guard";
        command.push_back(concat("--property=RuntimeDirectory=", runtime_folder));
        command.push_back("--property=RuntimeDirectoryMode=0700");
        command.push_back(
            concat("--property=ExecStartPre=-+", guard.string(), " --pin-users /run/", runtime_folder));
        command.push_back(
            concat("--property=ExecStopPost=-+", guard.string(), " --unpin-users /run/", runtime_folder));
    }
    for (auto const& word : {program.string(), std::string("--doctor"), std::string("--json"),
                             fs::absolute(config, failed).string()})
        command.push_back(word);
    return command;
}

} // namespace

ServiceView view_of_service(std::string_view kind, Arguments const& arguments, fs::path const& socket)
{
    ServiceView view;
    auto const systemctl = find_system_program("systemctl");
    auto const systemd_run = find_system_program("systemd-run");
    // Only root can have systemd start something as the service is started. The doctor that is started so
    // does not do it again.
    if (::geteuid() != 0 || is_asked_by_root() || systemctl.empty() || systemd_run.empty())
        return view;
    auto const name = concat("webots-", kind, "-server");
    auto const text = adapters::program_output(
        {systemctl.string(), "cat", "--no-pager", concat(name, ".service")}, systemd_limit);
    if (!text)
        return view;
    auto const unit = core::parse_service_unit(*text, name);
    if (!has_configuration(unit, arguments.config))
        return view;
    auto const instance = ask_instance(socket); // where the server hangs, the doctor finds that out itself
    auto const said = adapters::program_output(
        doctor_command(systemd_run, unit, arguments.config, instance ? *instance : std::string()),
        doctor_limit);
    auto const found = said ? core::parse_findings(*said) : result<core::Findings>(said.error());
    view.is_complete = found.has_value();
    if (!found) {
        view.findings.emplace_back(
            Verdict::fault, "service",
            concat("systemd can't start a program as ", name, ".service does: ", found.error().message()),
            concat("What follows is what root sees, not the service. Look at systemctl cat ", name,
                   ", and at journalctl -u ", name, "."));
        return view;
    }
    view.findings.emplace_back(
        Verdict::ok, "service",
        concat("looked at with the user, the folders and the confinement of ", name, ".service"));
    std::ranges::copy_if(*found, std::back_inserter(view.findings), [](core::Finding const& each) {
        return std::ranges::find(seen_by_root_alone, each.subject) == std::end(seen_by_root_alone);
    });
    return view;
}

bool is_asked_by_root()
{
    return !environment(mark).empty();
}

std::string instance_told_by_root()
{
    return is_asked_by_root() ? environment(told_instance) : std::string();
}

} // namespace webots_cloud::app
