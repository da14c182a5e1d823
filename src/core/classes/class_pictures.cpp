#include "class_pictures.hpp"

#include <algorithm>
#include <vector>

namespace webots_cloud::core {
namespace {

constexpr std::size_t picture_bits_per_second = 1'820'000; // what students report takes some of the 2 Mbit/s
constexpr std::size_t around_picture = 50;                 // bytes of JSON and of the WebSocket's frame
constexpr auto shortest = std::chrono::milliseconds(500);
constexpr auto step = std::chrono::milliseconds(250); // so that not everybody who comes changes it for all

constexpr std::size_t base64_size(std::size_t bytes) noexcept
{
    return (bytes + 2) / 3 * 4;
}

/// The value of a digit of base64; -1 for anything else.
int base64_digit(char c) noexcept
{
    constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    auto const found = digits.find(c);
    return found == std::string_view::npos ? -1 : static_cast<int>(found);
}

/// Empty: a character is no digit.
std::vector<unsigned> bytes_of(std::string_view digits)
{
    std::vector<unsigned> bytes;
    unsigned bits = 0;
    int count = 0;
    for (char const c : digits) {
        auto const digit = base64_digit(c);
        if (digit < 0)
            return {};
        bits = (bits << 6 | static_cast<unsigned>(digit)) & 0xFFFF;
        count += 6;
        if (count >= 8) {
            count -= 8;
            bytes.push_back(bits >> count & 0xFF);
        }
    }
    return bytes;
}

/// Whether the frame of a JPEG (ITU T.81, B.2.2) is not larger than this. Before it there are segments alone.
bool is_small_jpeg(std::vector<unsigned> const& bytes, int max_width, int max_height)
{
    auto const two_at = [&bytes](std::size_t at) { return static_cast<int>(bytes[at] << 8 | bytes[at + 1]); };
    constexpr unsigned tables = 0xC4, extension = 0xC8, arithmetic = 0xCC; // which lie between the frames
    std::size_t at = 2;
    while (at + 9 <= bytes.size()) {
        if (bytes[at] != 0xFF)
            return false;
        auto const marker = bytes[at + 1];
        auto const length = two_at(at + 2);
        if (marker >= 0xC0 && marker <= 0xCF && marker != tables && marker != extension &&
            marker != arithmetic) {
            auto const height = two_at(at + 5);
            auto const width = two_at(at + 7);
            return height > 0 && height <= max_height && width > 0 && width <= max_width;
        }
        bool const is_segment = marker == tables || marker == arithmetic || marker == 0xDB || // tables
                                marker == 0xDD || (marker >= 0xE0 && marker <= 0xEF) || marker == 0xFE;
        if (!is_segment || length < 2)
            return false;
        at += 2 + static_cast<std::size_t>(length);
    }
    return false;
}

} // namespace

PictureTerms picture_terms(std::size_t students)
{
    PictureTerms terms;
    auto const bits = students * (base64_size(terms.bytes) + around_picture) * 8;
    std::chrono::milliseconds const needed((bits * 1000 + picture_bits_per_second - 1) /
                                           picture_bits_per_second);
    terms.interval = std::max(shortest, (needed + step - std::chrono::milliseconds(1)) / step * step);
    return terms;
}

bool is_picture_in_base64(std::string_view text, PictureTerms const& terms)
{
    constexpr std::string_view jpeg = "/9j/"; // FF D8 FF
    if (text.size() > base64_size(terms.bytes) || text.size() % 4 != 0 || !text.starts_with(jpeg))
        return false;
    for (int padding = 0; padding < 2 && text.ends_with('='); ++padding)
        text.remove_suffix(1);
    return is_small_jpeg(bytes_of(text), terms.width, terms.height);
}

} // namespace webots_cloud::core
