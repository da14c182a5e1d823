#include <webots_cloud/load_report.hpp>

#include "core/forge_link.hpp"
#include "core/text.hpp"

#include <string>

namespace webots_cloud {

namespace {

/// FNV-1a, and a mixing step of SplitMix64, since addresses differ in few characters.
class Digest
{
public:
    explicit Digest(std::uint64_t seed) noexcept : hash_(0xcbf29ce484222325u ^ seed) {}

    Digest& add(std::string_view text) noexcept
    {
        for (char const c : text)
            hash_ = (hash_ ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
        return *this;
    }

    std::uint64_t finish() const noexcept
    {
        auto hash = (hash_ ^ (hash_ >> 30)) * 0xbf58476d1ce4e5b9u;
        hash = (hash ^ (hash >> 27)) * 0x94d049bb133111ebu;
        return hash ^ (hash >> 31);
    }

private:
    std::uint64_t hash_;
};

std::uint64_t digest(std::string_view text, std::uint64_t seed) noexcept
{
    return Digest(seed).add(text).finish();
}

} // namespace

WorldKey world_key(std::string_view address, std::string_view mode) noexcept
{
    WorldKey key;
    key.mode = digest(mode, 1);
    Digest repository(key.mode + 2);
    Digest world(key.mode + 3);
    auto const place = core::placed_link(core::without_query(address));
    if (auto const link = core::forge_link(place)) {
        for (auto* const each : {&repository, &world})
            each->add(place.site).add("/").add(link->names);
        world.add("/blob/").add(link->ref_space).add(link->rest);
    } else {
        repository.add(address);
        world.add(address);
    }
    key.repository = repository.finish();
    key.world = world.finish();
    return key;
}

std::uint32_t project_key(std::string_view world_address)
{
    std::string_view const location = core::without_query(world_address);
    std::string decoded;
    if (!core::percent_decode(location, decoded))
        decoded = location;
    auto const place = core::placed_link(decoded);
    auto const link = core::forge_link(place);
    if (!link)
        return project_key(decoded, {});
    auto const ref_and_folder = link->rest.substr(0, link->rest.rfind("/worlds/"));
    return project_key(core::concat(place.site, "/", link->names),
                       core::concat(link->ref_space, ref_and_folder));
}

std::uint32_t project_key(std::string_view repository, std::string_view ref_and_folder) noexcept
{
    return static_cast<std::uint32_t>(digest(ref_and_folder, digest(repository, 4)) >> 32);
}

} // namespace webots_cloud
