#include "subordinate_range.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <string>

namespace webots_cloud::core {
namespace {

constexpr std::uint32_t users_needed = 0x1'0000;   // one for each port
constexpr std::uint64_t usual_first = 100'000;     // as useradd begins
constexpr std::uint64_t last_number = 0xFFFF'FFFE; // above it is "no user"

struct Range
{
    std::string_view owner;
    std::uint64_t first = 0;
    std::uint64_t count = 0;
};

bool read_number(std::string_view text, std::uint64_t& number)
{
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    return error == std::errc() && end == text.data() + text.size();
}

/// Of a line `owner:first:count`.
std::optional<Range> parse(std::string_view line)
{
    auto const parts = split(trim(line), ':');
    Range range;
    if (parts.size() != 3 || !read_number(parts[1], range.first) || !read_number(parts[2], range.count) ||
        range.first > last_number || range.count > last_number - range.first)
        return std::nullopt;
    range.owner = parts[0];
    return range;
}

/// Our first range that is large enough. `free`: where a new one may begin, beyond all that are in the file.
std::optional<Range> find(std::string_view text, SubordinateContext const& context, std::uint64_t& free)
{
    std::optional<Range> found;
    auto const number = std::to_string(context.user);
    for (auto const line : split(text, '\n')) {
        auto const range = parse(line);
        if (!range)
            continue;
        free = std::max(free, range->first + range->count);
        bool const is_ours = range->owner == context.name || range->owner == number;
        if (is_ours && range->count >= users_needed && !found)
            found = range;
    }
    return found;
}

} // namespace

result<SubordinateRange> find_subordinate_range(SubordinateContext const& context)
{
    if (context.no_new_privs)
        return Failure(errc::unavailable,
                       concat("no_new_privs, as systemd's NoNewPrivileges= sets it, forbids newuidmap",
                              context.pinned.empty()
                                  ? std::string()
                                  : concat(", and there is no ", context.pinned.string(),
                                           ", which ExecStartPre= of our unit makes: take over that line, "
                                           "or see in the journal of the service why it has failed")));
    if (context.name.empty())
        return Failure(errc::unavailable, concat("the server's user, number ", std::to_string(context.user),
                                                 ", has no name in /etc/passwd"));
    if (context.newuidmap.empty() || context.newgidmap.empty())
        return Failure(errc::unavailable, "install newuidmap and newgidmap (Debian's package uidmap)");
    std::uint64_t free = usual_first;
    auto const users = find(context.users, context, free);
    auto const groups = find(context.groups, context, free);
    if (!users || !groups) {
        std::string_view files = "/etc/subuid and to /etc/subgid";
        if (users)
            files = "/etc/subgid";
        else if (groups)
            files = "/etc/subuid";
        return Failure(errc::unavailable, concat("add the line \"", context.name, ":", std::to_string(free),
                                                 ":", std::to_string(users_needed), "\" to ", files));
    }
    SubordinateRange range;
    range.newuidmap = context.newuidmap;
    range.newgidmap = context.newgidmap;
    range.first_user = static_cast<std::uint32_t>(users->first);
    range.first_group = static_cast<std::uint32_t>(groups->first);
    range.count = static_cast<std::uint32_t>(std::min(users->count, groups->count));
    return range;
}

} // namespace webots_cloud::core
