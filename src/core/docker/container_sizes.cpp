#include "container_sizes.hpp"

#include "characters.hpp"
#include "core/text.hpp"
#include "labels.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::core {

std::uint64_t container_bytes(std::string_view size)
{
    constexpr std::string_view units = "kMGTP"; // powers of a thousand
    double number = 0;
    auto const end = size.data() + size.size();
    auto const read = std::from_chars(size.data(), end, number, std::chars_format::fixed);
    if (read.ec != std::errc() || !(number >= 0 && number < 1e6)) // docker takes the next unit from 1000 on
        return 0;
    auto const unit = read.ptr == end ? std::string_view::npos : units.find(*read.ptr);
    for (std::size_t power = 0; unit != std::string_view::npos && power <= unit; ++power)
        number *= 1000;
    return number < 1e18 ? static_cast<std::uint64_t>(number) : std::uint64_t{1} << 60;
}

std::vector<std::string> list_container_sizes(std::string_view project)
{
    return {"ps",         "--all",
            "--no-trunc", "--size",
            "--filter",   concat("label=", project_label, "=", project),
            "--format",   "{{.Size}}\t{{.Mounts}}"};
}

ContainerSizes parse_container_sizes(std::string_view listing)
{
    ContainerSizes sizes;
    for (auto const line : split(listing, '\n')) {
        auto const fields = split(line, '\t');
        sizes.bytes += container_bytes(fields[0]);
        if (fields.size() != 2)
            continue;
        for (auto const mount : split(fields[1], ',')) { // folders of the machine begin with a slash
            bool const is_volume = !mount.empty() && (is_letter(mount.front()) || is_digit(mount.front())) &&
                                   consists_of(mount, "_.-");
            if (is_volume &&
                std::find(sizes.volumes.begin(), sizes.volumes.end(), mount) == sizes.volumes.end())
                sizes.volumes.emplace_back(mount);
        }
    }
    return sizes;
}

std::vector<std::string> list_volume_sizes()
{
    return {"system", "df", "--verbose", "--format", "{{range .Volumes}}{{.Name}}\t{{.Size}}\n{{end}}"};
}

std::uint64_t volume_bytes(std::string_view listing, std::vector<std::string> const& volumes)
{
    std::uint64_t bytes = 0;
    for (auto const line : split(listing, '\n')) {
        auto const fields = split(line, '\t');
        if (fields.size() == 2 && std::find(volumes.begin(), volumes.end(), fields[0]) != volumes.end())
            bytes += container_bytes(fields[1]);
    }
    return bytes;
}

} // namespace webots_cloud::core
