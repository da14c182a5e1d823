#include "own_confinement.hpp"

#include "core/config/session_files.hpp"
#include "daemon.hpp"
#include "environment.hpp"
#include "operator_requests.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <initializer_list>
#include <sys/stat.h>

namespace webots_cloud::app {
namespace {

namespace fs = std::filesystem;

/// A link leads to a folder of its own, which may be another one tomorrow: as it is now.
void add_targets(std::vector<fs::path>& files, fs::path const& file)
{
    std::error_code failed;
    auto const target = fs::canonical(file, failed);
    if (!failed)
        files.push_back(target.parent_path());
}

/// Files and folders that certificates are found by.
void add_authorities(std::vector<fs::path>& files)
{
    for (auto const* name : {"SSL_CERT_FILE", "SSL_CERT_DIR", "CURL_CA_BUNDLE"})
        if (auto const value = environment(name); !value.empty())
            files.push_back(absolute_path(value));
}

constexpr std::size_t max_links = 1000;

/// Operators may have put links to projects and keys into their folders.
void add_links(std::vector<fs::path>& files, fs::path const& folder, int depth)
{
    std::error_code failed;
    for (auto const& entry : fs::directory_iterator(folder, failed)) {
        if (files.size() > max_links)
            return;
        if (entry.is_symlink(failed)) {
            if (auto target = fs::canonical(entry.path(), failed); !failed)
                files.push_back(std::move(target));
        }
        if (depth > 1 && entry.is_directory(failed))
            add_links(files, entry.path(), depth - 1);
    }
}

/// Where a folder will be that somebody has yet to make.
fs::path nearest(fs::path folder)
{
    std::error_code failed;
    while (folder.has_relative_path() && !fs::exists(folder, failed))
        folder = folder.parent_path();
    return folder.has_relative_path() ? folder : fs::path();
}

void make_absolute(std::initializer_list<fs::path*> paths)
{
    for (auto* const path : paths)
        *path = absolute_path(*path);
}

void make_absolute(NetworkConfig& network, AccessConfig& access)
{
    make_absolute({&network.ssl_certificate, &network.ssl_key, &network.challenge_folder,
                   &access.operator_token_file, &access.session_secret});
}

/// What the paths of these lead to, and what certificates are found by.
void add_targets(std::vector<fs::path>& files, fs::path const& config_file, NetworkConfig const& network,
                 AccessConfig const& access)
{
    for (auto const& file : core::files_of_configuration(config_file, network, access))
        add_targets(files, file);
    add_authorities(files);
}

} // namespace

result<> confine_session_server(SessionConfig config, fs::path const& config_file)
{
    make_absolute({&config.log_dir, &config.http_client.authorities, &config.service.teacher_password_file});
    make_absolute(config.network, config.access);
    auto const file = absolute_path(config_file);
    auto const socket = operator_socket("session", config.address.port, config.access);
    auto files = core::session_server_files(config, file, socket);
    add_targets(files.read, file, config.network, config.access);
    add_targets(files.read, config.http_client.authorities);
    add_targets(files.read, config.service.teacher_password_file);
    // What is not there yet can have no rule.
    std::error_code failed;
    fs::create_directories(config.log_dir, failed);
    (void)!::mkdir(socket.parent_path().c_str(), 0700); // as the socket itself would make it
    return confine_to_files(files);
}

result<> confine_simulation_server(SimulationConfig config, core::SimulationFilesContext context)
{
    context.config_file = absolute_path(context.config_file);
    context.socket = operator_socket("simulation", config.address.port, config.access);
    make_absolute({&config.log_dir, &config.websites.keys, &config.containers.directory,
                   &config.http_client.authorities, &context.caches, &context.templates});
    make_absolute(config.network, config.access);
    for (auto& forge : config.forges)
        forge.directory = nearest(absolute_path(forge.directory));
    auto files = core::simulation_server_files(config, context);
    add_targets(files.read, context.config_file, config.network, config.access);
    add_targets(files.read, config.http_client.authorities);
    for (auto const& forge : config.forges)
        if (!forge.is_server())
            add_links(files.read, forge.directory, 2); // <owner>/<repository>
    if (!config.docker) {
        add_links(files.read, config.websites.keys, 1);
        add_links(files.read, context.templates, 1);
    }
    // As for the session server: folders have to be there to get a rule.
    std::error_code failed;
    fs::create_directories(config.log_dir, failed);
    fs::create_directories(context.caches, failed);
    (void)!::mkdir(context.socket.parent_path().c_str(), 0700);
    return confine_to_files(files);
}

} // namespace webots_cloud::app
