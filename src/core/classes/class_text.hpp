// The short texts of classes: codes that people read to each other, names, addresses of worlds.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

/// So many bytes that nobody can guess.
using RandomBytes = std::function<std::string(std::size_t size)>;

/// Six letters and digits, none of which looks like another: `K7M2QX`.
std::string make_class_code(RandomBytes const& random);

/// A code as people type it, in small letters, with spaces or hyphens. Empty: it can't be one.
std::string read_class_code(std::string_view typed);

/// 32 hexadecimal digits, for keys and tokens.
std::string make_class_token(RandomBytes const& random);

/// A line that people write for others, without blanks at its ends. None: it is empty or longer than
/// `max_characters`, is not UTF-8, or has characters that are not seen where they are (`CharacterKind`), so
/// that one name could look like another, or a heap of accents on one. Spaces of all kinds become that of
/// ASCII.
std::optional<std::string> line_of_person(std::string_view text, std::size_t max_characters);

/// Whether a text can be the address of a world: `<scheme>:...<file>.wbt`. Whether that world may run is for
/// the simulation servers to say.
bool is_world_address(std::string_view text);

} // namespace webots_cloud::core
