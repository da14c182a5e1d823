#include "session_files.hpp"

#include <array>

namespace webots_cloud::core {

std::span<char const* const> folders_of_libraries() noexcept
{
    // Some load libraries late; name servers have caches.
    static constexpr std::array folders{"/usr",
                                        "/lib",
                                        "/lib32",
                                        "/lib64",
                                        "/etc",
                                        "/run",
                                        "/proc",
                                        "/sys",
                                        "/dev/urandom",
                                        "/dev/random",
                                        "/var/lib/ca-certificates"}; // openSUSE's
    return folders;
}

OwnFiles session_server_files(SessionConfig const& config, std::filesystem::path const& config_file,
                              std::filesystem::path const& socket)
{
    OwnFiles files;
    auto const system = folders_of_libraries();
    files.read.assign(system.begin(), system.end());
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
