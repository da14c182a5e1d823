#include "zip_directory.hpp"

#include "text.hpp"

#include <string>

namespace webots_cloud::core {
namespace {

constexpr std::string_view end_signature("PK\5\6", 4);
constexpr std::size_t end_size = 22;
constexpr std::uint64_t longest_entry = 512; // on average: header, name and what else is noted of one

std::uint32_t little_endian(std::string_view bytes, std::size_t count)
{
    std::uint32_t value = 0;
    while (count-- > 0)
        value = value << 8 | static_cast<unsigned char>(bytes[count]);
    return value;
}

Failure no_zip(std::string_view why)
{
    return {errc::protocol_error, concat("Bad ZIP file: ", why, ".")};
}

} // namespace

result<> check_zip_directory(std::string_view tail, std::uint64_t size, std::uint32_t most_entries)
{
    auto const at =
        tail.size() < end_size ? std::string_view::npos : tail.rfind(end_signature, tail.size() - end_size);
    if (at == std::string_view::npos)
        return no_zip("it has no end, or is something else");
    auto const record = tail.substr(at);
    auto const entries = little_endian(record.substr(10), 2);
    auto const length = little_endian(record.substr(12), 4);
    auto const offset = little_endian(record.substr(16), 4);
    if (little_endian(record.substr(4), 4) != 0 || little_endian(record.substr(8), 2) != entries)
        return no_zip("it is one part of several");
    if (std::uint64_t{offset} + length != size - tail.size() + at)
        return no_zip("its list of files is not where it should be");
    if (entries > most_entries || length > longest_entry * most_entries)
        return Failure(errc::too_large,
                       concat("The project has more than ", std::to_string(most_entries), " files."));
    return {};
}

} // namespace webots_cloud::core
