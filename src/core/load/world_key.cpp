#include <webots_cloud/load_report.hpp>

#include "core/text.hpp"

#include <algorithm>
#include <string>

namespace webots_cloud {

namespace {

/// FNV-1a, and a mixing step of SplitMix64, since addresses differ in few characters.
std::uint64_t digest(std::string_view text, std::uint64_t seed) noexcept
{
    std::uint64_t hash = 0xcbf29ce484222325u ^ seed;
    for (char const c : text)
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    hash = (hash ^ (hash >> 30)) * 0xbf58476d1ce4e5b9u;
    hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
    return hash ^ (hash >> 31);
}

/// Up to `/blob/` or `/tree/`; all of an address that has neither.
std::string_view repository_of(std::string_view address) noexcept
{
    return address.substr(0, std::min(address.find("/blob/"), address.find("/tree/")));
}

} // namespace

WorldKey world_key(std::string_view address, std::string_view mode) noexcept
{
    WorldKey key;
    key.mode = digest(mode, 1);
    key.repository = digest(repository_of(address), key.mode + 2);
    key.world = digest(address, key.mode + 3);
    return key;
}

std::uint32_t project_key(std::string_view world_address)
{
    std::string_view const location = core::without_query(world_address);
    std::string decoded;
    if (!core::percent_decode(location, decoded))
        decoded = location;
    std::string_view const address = decoded;
    std::string_view const repository = repository_of(address);
    std::string_view rest = address.substr(repository.size());
    rest.remove_prefix(std::min(rest.size(), std::string_view("/blob/").size()));
    return project_key(repository, rest.substr(0, rest.rfind("/worlds/")));
}

std::uint32_t project_key(std::string_view repository, std::string_view ref_and_folder) noexcept
{
    return static_cast<std::uint32_t>(digest(ref_and_folder, digest(repository, 4)) >> 32);
}

} // namespace webots_cloud
