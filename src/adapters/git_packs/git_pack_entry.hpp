// How each object in a pack begins.
#pragma once

#include "core/git/git_object_id.hpp"
#include "core/git/git_problem.hpp"

#include <webots_cloud/error.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

inline Failure malformed_pack(char const* what)
{
    return {core::GitProblem::malformed, std::string("the git server sent a malformed pack: ") + what};
}

enum GitPackType : unsigned
{
    pack_commit = 1,
    pack_tree = 2,
    pack_blob = 3,
    pack_tag = 4,
    pack_offset_delta = 6,
    pack_reference_delta = 7
};

/// The start of an entry, as far as it is there.
struct GitPackEntry
{
    unsigned type = 0;
    std::uint64_t size = 0;
    std::uint64_t base_distance = 0;
    core::GitObjectId base;
    std::size_t length = 0;
};

/// Nothing: more bytes are needed.
inline result<std::optional<GitPackEntry>> parse_pack_entry(std::string_view bytes)
{
    constexpr std::size_t id_size = 20;
    std::size_t at = 0;
    auto const more = [&] { return at < bytes.size(); };
    auto const next = [&] { return static_cast<std::uint8_t>(bytes[at++]); };
    std::optional<GitPackEntry> const incomplete;
    if (!more())
        return incomplete;
    GitPackEntry header;
    unsigned byte = next();
    header.type = (byte >> 4) & 7;
    header.size = byte & 15;
    for (unsigned shift = 4; byte & 0x80; shift += 7) {
        if (!more())
            return incomplete;
        if (shift > 53)
            return malformed_pack("an object of absurd size");
        byte = next();
        header.size |= std::uint64_t{byte & 0x7F} << shift;
    }
    if (header.type == pack_offset_delta) {
        if (!more())
            return incomplete;
        byte = next();
        header.base_distance = byte & 0x7F;
        while (byte & 0x80) {
            if (!more())
                return incomplete;
            if (header.base_distance >> 50)
                return malformed_pack("a delta without base");
            byte = next();
            header.base_distance = ((header.base_distance + 1) << 7) | (byte & 0x7F);
        }
    } else if (header.type == pack_reference_delta) {
        if (bytes.size() - at < id_size)
            return incomplete;
        std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), id_size, header.base.bytes.begin());
        at += id_size;
    }
    header.length = at;
    return std::optional(header);
}

} // namespace webots_cloud::adapters
