#include "zip_directory.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <string>

namespace webots_cloud::core {
namespace {

constexpr std::string_view end_signature("PK\5\6", 4);
constexpr std::string_view large_end_signature("PK\6\6", 4);
constexpr std::string_view locator_signature("PK\6\7", 4);
constexpr std::size_t end_size = 22;
constexpr std::size_t large_end_size = 56;
constexpr std::size_t locator_size = 20;
constexpr std::uint64_t max_entry_size = 512; // on average: header, name and what else is noted of one

std::uint64_t little_endian(std::string_view bytes, std::size_t count)
{
    std::uint64_t value = 0;
    while (count-- > 0)
        value = value << 8 | static_cast<unsigned char>(bytes[count]);
    return value;
}

Failure no_zip(std::string_view why)
{
    return refused(Refused::bad_zip, {{"words", why}});
}

/// The list of entries, as the end of the file describes it.
struct Directory
{
    std::uint64_t entries = 0;
    std::uint64_t length = 0;
    std::uint64_t offset = 0;
    bool whole = true; ///< No other part of the archive has more of it.
};

Directory read_end(std::string_view record)
{
    Directory directory;
    directory.entries = little_endian(record.substr(10), 2);
    directory.length = little_endian(record.substr(12), 4);
    directory.offset = little_endian(record.substr(16), 4);
    directory.whole =
        little_endian(record.substr(4), 4) == 0 && little_endian(record.substr(8), 2) == directory.entries;
    return directory;
}

/// The same in larger numbers ("zip64").
Directory read_large_end(std::string_view record)
{
    Directory directory;
    directory.entries = little_endian(record.substr(32), 8);
    directory.length = little_endian(record.substr(40), 8);
    directory.offset = little_endian(record.substr(48), 8);
    directory.whole =
        little_endian(record.substr(16), 8) == 0 && little_endian(record.substr(24), 8) == directory.entries;
    return directory;
}

/// Readers differ in which of the two they believe, so they must not differ: a number of the small one is
/// that of the large one, or all ones.
bool agree(Directory const& small, Directory const& large)
{
    return (small.entries == large.entries || small.entries == 0xFFFF) &&
           (small.length == large.length || small.length == 0xFFFFFFFF) &&
           (small.offset == large.offset || small.offset == 0xFFFFFFFF);
}

/// Where the list is said to end, as a position in the tail, and what it is said to be.
struct End
{
    std::size_t at = 0;
    Directory directory;
};

/// `small`: what the last record says. Before it may be one with larger numbers, and between the two one that
/// points there. `before`: bytes of the file in front of the tail.
result<End> find_end(std::string_view tail, End const& small, std::uint64_t before)
{
    if (small.at < locator_size || !tail.substr(small.at - locator_size).starts_with(locator_signature))
        return small;
    auto const locator = tail.substr(small.at - locator_size);
    End large;
    large.at = small.at - std::min(small.at, locator_size + large_end_size);
    if (!tail.substr(large.at).starts_with(large_end_signature) || tail.size() - large.at < large_end_size ||
        little_endian(locator.substr(8), 8) != before + large.at)
        return no_zip("its end is not where it should be");
    large.directory = read_large_end(tail.substr(large.at));
    if (little_endian(locator.substr(4), 4) != 0 || little_endian(locator.substr(16), 4) != 1 ||
        !agree(small.directory, large.directory))
        return no_zip("it has two ends that contradict each other");
    return large;
}

} // namespace

result<> check_zip_directory(std::string_view tail, std::uint64_t size, std::uint32_t max_entries)
{
    End small;
    small.at =
        tail.size() < end_size ? std::string_view::npos : tail.rfind(end_signature, tail.size() - end_size);
    if (small.at == std::string_view::npos)
        return no_zip("it has no end, or is something else");
    small.directory = read_end(tail.substr(small.at));
    auto const before = size - tail.size();
    auto const end = find_end(tail, small, before);
    if (!end)
        return end.error();
    auto const& directory = end->directory;
    if (!directory.whole)
        return no_zip("it is one part of several");
    if (directory.length > before + end->at || directory.offset != before + end->at - directory.length)
        return no_zip("its list of files is not where it should be");
    if (directory.entries > max_entries || directory.length > max_entry_size * max_entries)
        return refused(Refused::too_many_files, {{"max", std::to_string(max_entries)}});
    return {};
}

} // namespace webots_cloud::core
