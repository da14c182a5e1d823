// Small pure text functions that several rooms need.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace webots_cloud::core {

/// All pieces in one string, allocated once.
template<class... Pieces>
std::string concat(Pieces const&... pieces)
{
    std::string text;
    text.reserve((std::string_view(pieces).size() + ...));
    (text.append(std::string_view(pieces)), ...);
    return text;
}

/// For hash tables by strings in which views are looked up, with `std::equal_to<>`.
struct TextHash
{
    using is_transparent = void;
    std::size_t operator()(std::string_view text) const noexcept
    {
        return std::hash<std::string_view>()(text);
    }
};

/// As the type of an argument that is forwarded: a string that is gone at the end of the statement. What
/// returns views takes none.
template<class Text>
concept TemporaryString = std::same_as<std::remove_const_t<Text>, std::string>;

/// `text` split at each `separator`; always at least one piece.
std::vector<std::string_view> split(std::string_view text, char separator);
std::vector<std::string_view> split(TemporaryString auto&& text, char separator) = delete;

/// All of `pieces` in one string, with `separator` between any two.
std::string join(std::vector<std::string_view> const& pieces, std::string_view separator);

/// Without spaces, tabs, carriage returns and newlines at both ends.
std::string_view trim(std::string_view text) noexcept;
std::string_view trim(TemporaryString auto&& text) = delete;

/// With the capital letters of ASCII made small.
std::string lower_case(std::string_view text);

/// `text` made safe for HTML content and quoted attributes.
std::string escape_html(std::string_view text);

/// `text` made safe for a log line: what is not seen (`CharacterKind`) and invalid UTF-8 as `\xNN`, at most
/// `limit` bytes of it.
std::string printable(std::string_view text, std::size_t limit = 512);

/// True when `text` is well-formed UTF-8 and all of it is seen: what `printable` leaves as it is.
bool is_printable(std::string_view text) noexcept;

/// True when `text` is well-formed UTF-8 (no surrogates, no overlong forms).
bool is_utf8(std::string_view text) noexcept;

/// ` (203.0.113.7)`, for the end of a line of the log; nothing for nobody.
std::string of_client(std::string_view address);

/// A number as Python prints a float: the shortest digits that read back the same, `7.875`, `0.0`, `1e+16`.
std::string python_float(double value);

/// 17179869184: "16.0GB", of 2^30 bytes each, as the monitor pages say it.
std::string gigabytes(std::uint64_t bytes);

/// The value of a hexadecimal digit; -1 for anything else.
int hex_digit(char c) noexcept;

/// The number of a port, from 1 to 65535, without zeros at its beginning; 0: `text` is none.
std::uint16_t parse_port(std::string_view text) noexcept;

/// In constant time: how long it takes does not tell where they differ.
bool equal_in_constant_time(std::string_view left, std::string_view right) noexcept;

/// `text` with each `%XX` replaced by its byte, or nothing when an escape is malformed.
bool percent_decode(std::string_view text, std::string& decoded);

/// A URL without its query and fragment.
std::string_view without_query(std::string_view url) noexcept;
std::string_view without_query(TemporaryString auto&& url) = delete;

/// The one of `candidates` that is nearest to `word` (Levenshtein), or empty when none is near.
std::string_view nearest(std::string_view word, std::vector<std::string_view> const& candidates);

} // namespace webots_cloud::core
