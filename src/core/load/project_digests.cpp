#include "project_digests.hpp"

#include "core/base64.hpp"

#include <array>

namespace webots_cloud::core {
namespace {

constexpr unsigned bits_of_digit = 6;
constexpr unsigned bits_of_digest = 32;
constexpr std::uint8_t no_digit = 0xff;

/// A table, since reports are read all the time.
constexpr std::array<std::uint8_t, 256> make_values()
{
    std::array<std::uint8_t, 256> values{};
    values.fill(no_digit);
    for (std::size_t value = 0; value != base64url_digits.size(); ++value)
        values[static_cast<unsigned char>(base64url_digits[value])] = static_cast<std::uint8_t>(value);
    return values;
}

constexpr auto values = make_values();

} // namespace

std::string write_digests(std::vector<std::uint32_t> const& digests)
{
    std::string text;
    text.reserve((digests.size() * bits_of_digest + bits_of_digit - 1) / bits_of_digit);
    std::uint64_t bits = 0;
    unsigned count = 0;
    for (std::uint32_t const digest : digests) {
        bits = bits << bits_of_digest | digest;
        count += bits_of_digest;
        for (; count >= bits_of_digit; count -= bits_of_digit)
            text += base64url_digits[bits >> (count - bits_of_digit) & 63];
    }
    if (count != 0)
        text += base64url_digits[bits << (bits_of_digit - count) & 63];
    return text;
}

bool read_digests(std::string_view text, std::size_t max, std::vector<std::uint32_t>& digests)
{
    std::size_t const number = text.size() * bits_of_digit / bits_of_digest;
    if (number > max)
        return false;
    digests.reserve(digests.size() + number);
    std::uint64_t bits = 0;
    unsigned count = 0;
    for (char const c : text) {
        std::uint8_t const value = values[static_cast<unsigned char>(c)];
        if (value == no_digit)
            return false;
        bits = bits << bits_of_digit | value;
        count += bits_of_digit;
        if (count >= bits_of_digest) {
            count -= bits_of_digest;
            digests.push_back(static_cast<std::uint32_t>(bits >> count));
        }
    }
    // What is left over fills the last digit, with zeros.
    return count < bits_of_digit && (bits & ((std::uint64_t(1) << count) - 1)) == 0;
}

} // namespace webots_cloud::core
