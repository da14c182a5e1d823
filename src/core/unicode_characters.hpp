// What characters show, by Unicode's tables.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace webots_cloud::core {

enum class CharacterKind
{
    visible,
    mark,    ///< Shows on the character before it: an accent, a vowel sign.
    joining, ///< Changes how its neighbours look, as in Persian, Hindi and emoji of several parts.
    space,
    hidden ///< Shows nothing, turns the direction of writing, controls something, or is no character yet.
};

CharacterKind kind_of_character(std::uint32_t code) noexcept;

/// The number of bytes of the UTF-8 character at the start of `text`, which is not empty; 0: there is none.
std::size_t utf8_length(std::string_view text) noexcept;

/// The character that takes this many bytes there, which are not 0.
std::uint32_t code_point(std::string_view text, std::size_t length) noexcept;

} // namespace webots_cloud::core
