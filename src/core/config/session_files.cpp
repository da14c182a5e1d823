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

std::vector<std::filesystem::path> files_of_configuration(std::filesystem::path const& config_file,
                                                          NetworkConfig const& network,
                                                          AccessConfig const& access)
{
    return {config_file, network.ssl_certificate, network.ssl_key, access.operator_token_file,
            access.session_secret};
}

std::vector<std::filesystem::path> read_by_each_server(std::filesystem::path const& config_file,
                                                       NetworkConfig const& network,
                                                       AccessConfig const& access)
{
    auto const system = folders_of_libraries();
    std::vector<std::filesystem::path> read(system.begin(), system.end());
    for (auto const& file : files_of_configuration(config_file, network, access))
        if (!file.empty())
            read.push_back(file.parent_path());
    if (!network.challenge_folder.empty())
        read.push_back(network.challenge_folder);
    return read;
}

OwnFiles session_server_files(SessionConfig const& config, std::filesystem::path const& config_file,
                              std::filesystem::path const& socket)
{
    OwnFiles files;
    files.read = read_by_each_server(config_file, config.network, config.access);
    if (!config.http_client.authorities.empty())
        files.read.push_back(config.http_client.authorities.parent_path());
    if (!config.service.teacher_password_file.empty())
        files.read.push_back(config.service.teacher_password_file.parent_path());
    files.write = {config.log_dir, socket.parent_path(), "/dev/null"};
    return files;
}

} // namespace webots_cloud::core
