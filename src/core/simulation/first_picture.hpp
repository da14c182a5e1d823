// The first picture in what a simulator answers to `GET /mjpeg`: a stream of parts, each with its length.
#pragma once

#include <cstddef>
#include <string_view>

namespace webots_cloud::core {

/// The longest picture that is kept of a world.
inline constexpr std::size_t max_world_picture = std::size_t{256} << 10;
/// Of an answer that has one: what surrounds it, too.
inline constexpr std::size_t max_picture_answer = max_world_picture + (std::size_t{16} << 10);

/// A JPEG of at most `max_world_picture` bytes, by how it begins.
bool is_world_picture(std::string_view bytes) noexcept;

struct FirstPicture
{
    enum class State
    {
        incomplete, ///< More has to come.
        found,
        none ///< There will be none.
    };

    FirstPicture() = default;
    FirstPicture(State found, std::string_view bytes = {}) : state(found), picture(bytes) {}

    State state = State::incomplete;
    std::string_view picture; ///< In the answer.
};

/// `answer`: what has come of it, with its head. The simulator isn't trusted.
FirstPicture first_picture(std::string_view answer);

} // namespace webots_cloud::core
