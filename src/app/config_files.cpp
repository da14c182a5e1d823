// Files and folders that a configuration names, looked at before the server starts: what it can't do without
// is an error, what it can is a warning. The configuration itself has been read by then (core/config).
#include "adapters/host/accounts.hpp"
#include "adapters/operator/secret_file.hpp"
#include "certificate_finding.hpp"
#include "core/config/moved_ports.hpp"
#include "core/config/positioned_json.hpp"
#include "core/docker/container_walls.hpp"
#include "core/docker/docker_project.hpp"
#include "core/simulation/simulator_choice.hpp"
#include "core/text.hpp"
#include "daemon.hpp"
#include "environment.hpp"

#include <webots_cloud/adapters/files.hpp>
#include <webots_cloud/adapters/http_client.hpp>
#include <webots_cloud/adapters/http_server.hpp>
#include <webots_cloud/adapters/operator.hpp>
#include <webots_cloud/adapters/secrets.hpp>

#include <filesystem>

namespace webots_cloud::app {
namespace {

namespace fs = std::filesystem;
using core::concat;

constexpr std::size_t max_config_size = 1 << 20; // it is read again while the server runs

/// `config.json:3:7: key "sslKey"`: where a key stands whose file is unusable.
std::string place_of(fs::path const& origin, std::string_view key)
{
    std::string place;
    if (auto const text = read_config_file(origin)) {
        auto const read = core::read_positioned_json(*text);
        if (auto const found = read.place.members.find(key); found != read.place.members.end())
            place = concat(core::line_and_column(*text, found->second.value), ":");
    }
    return concat(origin.string(), ":", place, " key \"", key, "\"");
}

/// What keeps browsers from the server, although it starts, is a warning.
template<class Config>
result<> check_network(Configured<Config>& configured, fs::path const& origin)
{
    auto const& network = configured.config.network;
    if (network.ssl_certificate.empty())
        return {};
    auto const found = find_certificate_faults(network, configured.config.address);
    auto const& finding = found.finding;
    if (found.is_usable && finding.verdict == core::Verdict::ok)
        return {};
    auto const line = concat(place_of(origin, found.key), ": ", finding.found, ". ",
                             finding.remedy.substr(0, finding.remedy.size() - finding.remedy.ends_with('.')));
    if (!found.is_usable)
        return Failure(errc::invalid_config, line);
    configured.warnings.push_back(line);
    return {};
}

/// With the key that names the file.
result<> told_by(fs::path const& origin, std::string_view key, Failure const& why)
{
    return Failure(why.code(), concat(place_of(origin, key), ": ", why.message()));
}

template<class Config>
result<> check_trust(Configured<Config> const& configured, fs::path const& origin)
{
    auto const& file = configured.config.http_client.authorities;
    auto const trusted = file.empty() ? result<>() : check_authorities(file);
    return trusted ? trusted : told_by(origin, "caFile", trusted.error());
}

/// The files that every simulation in a container needs.
result<> check_templates(SimulationConfig const& config, fs::path const& origin)
{
    if (!config.docker)
        return {};
    std::vector<std::string> needed{core::compose_template_file(core::ComposeTemplate::standard)};
    if (!config.containers.project_dockerfiles)
        needed.emplace_back(core::dockerfile_template);
    std::error_code ignored;
    for (auto const& name : needed)
        if (!fs::exists(config.containers.directory / name, ignored))
            return Failure(
                errc::invalid_config,
                concat(place_of(origin, "docker"), ": no simulation can start, since there is no ", name,
                       " in ", fs::absolute(config.containers.directory, ignored).string(),
                       ". Set \"dockerDir\" to the folder of the templates, as config/simulation/docker"));
    return {};
}

/// Folders of the Python server, and copies of ours from before, have no such list.
void warn_of_missing_system_calls(Configured<SimulationConfig>& configured, fs::path const& origin)
{
    std::error_code ignored;
    auto const& config = configured.config;
    auto const file = config.containers.directory / core::system_calls_template;
    if (config.docker && !fs::exists(file, ignored))
        configured.warnings.push_back(concat(
            place_of(origin, "docker"), ": there is no ", core::system_calls_template, " in ",
            fs::absolute(config.containers.directory, ignored).string(),
            ". Simulations may use the system calls that Docker allows: with older releases sockets to "
            "the host of a virtual machine are among them. Copy it from config/simulation/docker"));
}

/// Containers have their own Webots.
result<> check_webots(SimulationConfig const& config, fs::path const& origin)
{
    if (config.docker)
        return {};
    auto const checked = core::check_webots_home(absolute_path(config.webots_home),
                                                 absolute_path(environment("WEBOTS_HOME")), is_program);
    if (checked)
        return checked;
    auto const place = config.webots_home.empty() ? concat(origin.string(), ": ", core::webots_home_variable)
                                                  : place_of(origin, "webotsHome");
    return checked.error().within(place);
}

void warn_of_challenges(std::vector<std::string>& warnings, NetworkConfig const& network,
                        fs::path const& origin)
{
    std::error_code ignored;
    auto const& folder = network.challenge_folder;
    if (!folder.empty() && !fs::is_directory(folder, ignored))
        warnings.push_back(concat(place_of(origin, "challengeFolder"), ": there is no folder ",
                                  fs::absolute(folder, ignored).string(),
                                  ": certbot can't prove that this host is yours until there is"));
}

/// A token that is not there yet opens nothing: `server.sh` makes that of a site.
template<class Config>
result<> check_access(Configured<Config>& configured, fs::path const& origin)
{
    auto const& access = configured.config.access;
    if (!access.session_secret.empty())
        if (auto const mac = make_ticket_mac(access.session_secret); !mac)
            return told_by(origin, "sessionSecret", mac.error());
    auto const& file = access.operator_token_file;
    if (file.empty())
        return {};
    std::error_code ignored;
    if (fs::status(file, ignored).type() == fs::file_type::not_found) {
        configured.warnings.push_back(concat(
            place_of(origin, "operatorTokenFile"), ": there is no file ",
            fs::absolute(file, ignored).string(),
            ": nobody is the operator over the network until a token is in it and the server gets SIGHUP"));
        return {};
    }
    auto const token = make_operator_token_check(file);
    return token ? result<>() : told_by(origin, "operatorTokenFile", token.error());
}

/// `auto` takes what there is; whoever asks for one of them has to install it.
result<> check_sandbox(Configured<SimulationConfig> const& configured, fs::path const& origin)
{
    auto const& name = configured.config.sandbox;
    std::string_view const program = name == "firejail" ? "firejail" : name == "bubblewrap" ? "bwrap" : "";
    if (program.empty() || configured.config.docker || !find_program(program).empty())
        return {};
    return Failure(errc::invalid_config,
                   concat(place_of(origin, "sandbox"), ": ", name,
                          " is not installed, and the server does not start without it: apt install ", name,
                          ", or write \"auto\", which takes what there is"));
}

/// Only whether a user that is named exists; whether simulations can run as that user is tried at the start.
result<> check_user(Configured<SimulationConfig> const& configured, fs::path const& origin)
{
    auto const& name = configured.config.simulation_user;
    bool const is_elsewhere = configured.config.docker || configured.config.slurm;
    if (is_elsewhere || name == "auto" || name == "none" || name == "subordinate" ||
        adapters::find_account(name))
        return {};
    return Failure(errc::invalid_config,
                   concat(place_of(origin, "simulationUser"), ": this machine has no user \"", name,
                          "\", and the server does not start without: make one, or write \"auto\""));
}

bool everybody_may_read(fs::path const& file)
{
    std::error_code failed;
    auto const path = fs::canonical(file, failed);
    auto const allows = [&](fs::path const& each, fs::perms wanted) {
        return (fs::status(each, failed).permissions() & wanted) == wanted && !failed;
    };
    bool may = !failed && allows(path, fs::perms::others_read);
    for (auto folder = path.parent_path(); may && folder != folder.root_path(); folder = folder.parent_path())
        may = allows(folder, fs::perms::others_exec);
    return may;
}

/// Simulations may run as other users than the server, or in its folders.
void warn_of_open_secret(std::vector<std::string>& warnings, fs::path const& file, std::string_view secret)
{
    if (everybody_may_read(file))
        warnings.push_back(concat(file.string(),
                                  ": everybody on this machine may read it, simulations too, and ", secret,
                                  " is in it. Run: chmod o-r on it"));
}

void warn_of_open_secrets(std::vector<std::string>& warnings, NetworkConfig const& network,
                          AccessConfig const& access, fs::path const& origin)
{
    if (!network.ssl_key.empty())
        warn_of_open_secret(warnings, network.ssl_key, "the server's private key");
    if (!access.monitor_password.empty())
        warn_of_open_secret(warnings, origin, "\"monitorPassword\"");
}

void warn_of_missing_folders(Configured<SimulationConfig>& configured, fs::path const& origin)
{
    std::error_code ignored;
    for (auto const& forge : configured.config.forges)
        if (!forge.is_server() && !fs::is_directory(forge.directory, ignored))
            configured.warnings.push_back(concat(place_of(origin, "forges"), ": there is no folder ",
                                                 fs::absolute(forge.directory, ignored).string(),
                                                 ": no world of ", forge.url, " can be fetched"));
    auto const& templates = configured.config.websites.projects;
    if (!configured.config.docker && !templates.empty() && !fs::is_directory(templates, ignored))
        configured.warnings.push_back(concat(place_of(origin, "projectsDir"), ": there is no folder ",
                                             fs::absolute(templates, ignored).string(),
                                             ": websites have no projects to start from"));
}

} // namespace

result<> check_files(Configured<SessionConfig>& configured, fs::path const& origin)
{
    warn_of_challenges(configured.warnings, configured.config.network, origin);
    warn_of_open_secrets(configured.warnings, configured.config.network, configured.config.access, origin);
    if (!configured.config.mail.password.empty())
        warn_of_open_secret(configured.warnings, origin, "\"mailSenderPassword\"");
    if (auto const certified = check_network(configured, origin); !certified)
        return certified;
    if (!configured.config.service.teacher_password.empty())
        warn_of_open_secret(configured.warnings, origin, "\"teacherPassword\"");
    if (auto const trusted = check_trust(configured, origin); !trusted)
        return trusted;
    if (auto const& file = configured.config.service.teacher_password_file; !file.empty()) {
        std::error_code ignored;
        if (!fs::exists(file, ignored))
            configured.warnings.push_back(
                concat(place_of(origin, "teacherPasswordFile"), ": there is no file ",
                       fs::absolute(file, ignored).string(),
                       ": nobody can open a class until a password is in it and the server gets SIGHUP"));
        else if (auto const password = adapters::read_password(file); !password)
            return told_by(origin, "teacherPasswordFile", password.error());
    }
    return check_access(configured, origin);
}

result<> check_files(Configured<SimulationConfig>& configured, fs::path const& origin)
{
    warn_of_challenges(configured.warnings, configured.config.network, origin);
    warn_of_missing_folders(configured, origin);
    warn_of_open_secrets(configured.warnings, configured.config.network, configured.config.access, origin);
    for (auto const& checked : {check_network(configured, origin), check_access(configured, origin),
                                check_trust(configured, origin), check_webots(configured.config, origin),
                                check_sandbox(configured, origin), check_user(configured, origin)})
        if (!checked)
            return checked;
    auto const has_templates = check_templates(configured.config, origin);
    if (has_templates)
        warn_of_missing_system_calls(configured, origin);
    return has_templates;
}

result<> move_ports(SessionConfig& config, int distance)
{
    return core::move_ports(config, distance);
}

result<> move_ports(SimulationConfig& config, int distance)
{
    return core::move_ports(config, distance);
}

result<std::string> read_config_file(fs::path const& path)
{
    std::error_code ignored;
    if (fs::is_directory(path, ignored))
        return Failure(errc::invalid_config,
                       path.string() + ": expected a configuration file, found a folder");
    auto text = read_regular_file(path, max_config_size);
    if (!text) {
        auto const target = fs::read_symlink(path, ignored);
        auto const advice =
            target.empty()
                ? std::string()
                : concat(". It is a link to ", target.string(),
                         ": if it has become one while the server runs, restart that, since it opens "
                         "only what was there at its start");
        return Failure(errc::invalid_config, concat(path.string(), ": the configuration can't be read: ",
                                                    text.error().message(), advice));
    }
    return text;
}

} // namespace webots_cloud::app
