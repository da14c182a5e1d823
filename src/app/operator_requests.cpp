#include "operator_requests.hpp"

#include "core/text.hpp"
#include "environment.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>

namespace webots_cloud::app {
namespace {

namespace fs = std::filesystem;
using core::concat;

/// As RuntimeDirectory of the units in config/systemd; the second of those of releases before 1.0.
constexpr std::array<char const*, 2> service_folders = {"/run/webots-cloud", "/run/webots_cloud"};

fs::path folder_of_user()
{
    auto const runtime = fs::path(environment("XDG_RUNTIME_DIR"));
    if (runtime.is_absolute())
        return runtime / "webots_cloud";
    return temporary_folder() / concat("webots-", std::to_string(::getuid()));
}

bool has_socket(fs::path const& path)
{
    struct stat found;
    return ::lstat(path.c_str(), &found) == 0 && S_ISSOCK(found.st_mode);
}

} // namespace

fs::path operator_socket(std::string_view kind, std::uint16_t port, AccessConfig const& access)
{
    if (!access.operator_socket.empty())
        return fs::absolute(access.operator_socket);
    auto const of_service = fs::path(environment("RUNTIME_DIRECTORY"));
    return (of_service.is_absolute() ? of_service : folder_of_user()) /
           concat(kind, "-", std::to_string(port), ".sock");
}

fs::path find_operator_socket(std::string_view kind, std::uint16_t port, AccessConfig const& access)
{
    auto const path = operator_socket(kind, port, access);
    if (!access.operator_socket.empty())
        return path;
    for (auto const* const folder : service_folders)
        if (auto const of_service = fs::path(folder) / kind / path.filename(); has_socket(of_service))
            return of_service;
    return path;
}

std::unique_ptr<OperatorSocket> open_operator_socket(boost::asio::any_io_executor const& executor,
                                                     std::string_view kind, std::uint16_t port,
                                                     AccessConfig const& access, std::string_view missing,
                                                     Logger const& log)
{
    auto socket = make_operator_socket(executor, operator_socket(kind, port, access), log);
    if (auto const listening = socket->listen(); !listening)
        log.warning(concat("No ", missing, ": ", listening.error().message()));
    return socket;
}

std::vector<std::string> machine_names()
{
    char name[256] = "";
    if (::gethostname(name, sizeof name - 1) != 0 || !*name)
        return {};
    return {name, concat(name, ".local")}; // the second by multicast DNS (RFC 6762)
}

result<OperatorTokenCheck> operator_token_check(AccessConfig const& access)
{
    std::error_code ignored;
    if (fs::status(access.operator_token_file, ignored).type() == fs::file_type::not_found) // as was warned
        return OperatorTokenCheck();
    return make_operator_token_check(access.operator_token_file);
}

} // namespace webots_cloud::app
