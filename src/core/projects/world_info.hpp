// What a world file says of itself: the fields `title` and `info` of its node WorldInfo.
#pragma once

#include <string>
#include <string_view>

namespace webots_cloud::core {

/// Enough of a world file: WorldInfo is its first node.
inline constexpr std::size_t world_info_bytes = std::size_t{32} << 10;

struct WorldInfo
{
    WorldInfo() = default;

    std::string title;
    std::string text; ///< The strings of `info` in one line, shortened.
};

/// Of the beginning of a world file, which may be anything. What isn't there is empty; what isn't seen, as
/// control characters, becomes a space.
WorldInfo world_info(std::string_view file);

/// Whether worlds of a project are to be listed: not where its `webots.yml` has `publish: false`.
bool is_published(std::string_view webots_yml);

/// At most that many bytes of `text` in one line; what is longer ends with an ellipsis after a whole word.
/// Empty if it isn't UTF-8.
std::string one_line(std::string_view text, std::size_t limit);

} // namespace webots_cloud::core
