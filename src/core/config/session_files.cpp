#include "session_files.hpp"

#include <initializer_list>

namespace webots_cloud::core {
namespace {

// Libraries that are loaded late (names are resolved by some, certificates checked), time zones, name servers
// and their caches, what the memory allocator and the metrics look at.
constexpr std::initializer_list<char const*> system_folders = {
    "/usr", "/lib", "/lib32", "/lib64", "/etc", "/run", "/proc", "/sys", "/dev/urandom", "/dev/random"};

} // namespace

OwnFiles session_server_files(SessionConfig const& config, std::filesystem::path const& config_file,
                              std::filesystem::path const& socket)
{
    OwnFiles files;
    files.read.assign(system_folders.begin(), system_folders.end());
    for (auto const& file : {config_file, config.network.ssl_certificate, config.network.ssl_key,
                             config.access.operator_token_file, config.access.session_secret})
        if (!file.empty())
            files.read.push_back(file.parent_path());
    if (!config.network.challenge_folder.empty())
        files.read.push_back(config.network.challenge_folder);
    files.write = {config.log_dir, socket.parent_path(), "/dev/null"};
    return files;
}

} // namespace webots_cloud::core
