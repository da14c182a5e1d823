#include "class_pictures.hpp"

#include <algorithm>

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

bool is_base64_digit(char c) noexcept
{
    return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '+' || c == '/';
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

bool is_jpeg_in_base64(std::string_view text, std::size_t max_bytes) noexcept
{
    constexpr std::string_view jpeg = "/9j/"; // FF D8 FF
    if (text.size() > base64_size(max_bytes) || text.size() % 4 != 0 || !text.starts_with(jpeg))
        return false;
    for (int padding = 0; padding < 2 && text.ends_with('='); ++padding)
        text.remove_suffix(1);
    return std::all_of(text.begin(), text.end(), is_base64_digit);
}

} // namespace webots_cloud::core
