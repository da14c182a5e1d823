#include "drm_clients.hpp"

#include "core/load/drm_text.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_files = 2048;
constexpr std::string_view device_folder = "/dev/dri/";

std::optional<core::DrmClient> read_client(fs::path const& path)
{
    std::array<char, 4096> text;
    std::ifstream file(path);
    file.read(text.data(), text.size());
    return core::parse_drm_client(std::string_view(text.data(), static_cast<std::size_t>(file.gcount())));
}

} // namespace

int count_drm_devices(fs::path const& devices)
{
    int count = 0;
    std::error_code error;
    for (fs::directory_iterator entry(devices, error); !error && entry != fs::directory_iterator();
         entry.increment(error))
        count += entry->path().filename().native().starts_with("renderD") ? 1 : 0;
    return count;
}

Duration drm_time(fs::path const& proc, std::span<int const> processes)
{
    Duration total{};
    std::size_t looked = 0;
    std::set<std::pair<std::string, std::uint64_t>> counted;
    for (int const process : processes) {
        auto const folder = proc / std::to_string(process);
        std::error_code error;
        for (fs::directory_iterator entry(folder / "fd", error); !error && entry != fs::directory_iterator();
             entry.increment(error)) {
            if (++looked > max_files)
                return total;
            std::error_code gone;
            if (!fs::read_symlink(entry->path(), gone).native().starts_with(device_folder))
                continue;
            auto const client = read_client(folder / "fdinfo" / entry->path().filename());
            if (client && counted.emplace(client->device, client->id).second)
                total += client->busy;
        }
    }
    return total;
}

} // namespace webots_cloud::adapters
