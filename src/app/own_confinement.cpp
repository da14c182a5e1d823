#include "core/config/session_files.hpp"
#include "environment.hpp"
#include "operator_requests.hpp"

#include <webots_cloud/adapters.hpp>
#include <webots_cloud/daemon.hpp>

#include <sys/stat.h>

namespace webots_cloud {
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

} // namespace

result<> confine_session_server(SessionConfig config, fs::path const& config_file)
{
    for (auto* path : {&config.log_dir, &config.network.ssl_certificate, &config.network.ssl_key,
                       &config.access.operator_token_file, &config.access.session_secret,
                       &config.network.challenge_folder})
        *path = app::absolute_path(*path);
    auto const file = app::absolute_path(config_file);
    auto const socket = app::operator_socket("session", config.address.port, config.access);
    auto files = core::session_server_files(config, file, socket);
    for (auto const& each : {file, config.network.ssl_certificate, config.network.ssl_key,
                             config.access.operator_token_file, config.access.session_secret})
        add_targets(files.read, each);
    for (auto const* name : {"SSL_CERT_FILE", "SSL_CERT_DIR", "CURL_CA_BUNDLE"})
        if (auto const value = app::environment(name); !value.empty())
            files.read.push_back(app::absolute_path(value));
    // What is not there yet can have no rule.
    std::error_code failed;
    fs::create_directories(config.log_dir, failed);
    (void)!::mkdir(socket.parent_path().c_str(), 0700); // as the socket itself would make it
    return confine_to_files(files);
}

} // namespace webots_cloud
