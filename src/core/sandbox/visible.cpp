#include "visible.hpp"

#include <algorithm>
#include <array>

namespace webots_cloud::core {

std::span<char const* const> system_folders() noexcept
{
    static constexpr std::array folders{"/usr", "/bin", "/sbin", "/lib", "/lib32", "/lib64"};
    return folders;
}

std::span<char const* const> system_files() noexcept
{
    // Without the cache of fonts each program that writes text reads all fonts first.
    static constexpr std::array files{"/etc/ld.so.cache",
                                      "/etc/alternatives",
                                      "/etc/passwd",
                                      "/etc/group",
                                      "/etc/nsswitch.conf",
                                      "/etc/hosts",
                                      "/etc/host.conf",
                                      "/etc/gai.conf",
                                      "/etc/protocols",
                                      "/etc/services",
                                      "/etc/localtime",
                                      "/etc/timezone",
                                      "/etc/locale.alias",
                                      "/etc/fonts",
                                      "/etc/mime.types",
                                      "/etc/ssl/certs",
                                      "/etc/ssl/openssl.cnf",
                                      "/etc/ca-certificates",
                                      "/etc/pki/tls/certs",
                                      "/etc/OpenCL",
                                      "/etc/vulkan",
                                      "/etc/glvnd",
                                      "/etc/drirc",
                                      "/etc/egl",
                                      "/etc/alsa",
                                      "/etc/asound.conf",
                                      "/etc/python3",
                                      "/etc/java",
                                      "/etc/ros",
                                      "/var/cache/fontconfig"};
    return files;
}

std::filesystem::path display_socket(std::string_view display)
{
    if (!display.starts_with(':'))
        return {};
    auto const number = display.substr(1, display.find('.') - 1);
    bool const is_number = !number.empty() && std::all_of(number.begin(), number.end(),
                                                          [](char c) { return c >= '0' && c <= '9'; });
    return is_number ? std::filesystem::path(display_folder) / ("X" + std::string(number))
                     : std::filesystem::path();
}

} // namespace webots_cloud::core
