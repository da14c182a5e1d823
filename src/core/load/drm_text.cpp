#include "drm_text.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <charconv>

namespace webots_cloud::core {
namespace {

constexpr std::string_view engine = "drm-engine-";
constexpr std::string_view capacity = "capacity-"; // how many engines of a kind there are
constexpr std::string_view nanoseconds = "ns";

/// The number that the text begins with, which is removed; nothing: there is none.
std::optional<std::uint64_t> take_number(std::string_view& text) noexcept
{
    std::uint64_t number = 0;
    auto const [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc())
        return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return number;
}

/// Nothing: the line is of another unit.
std::optional<Duration> busy_time(std::string_view value) noexcept
{
    auto const number = take_number(value);
    if (!number || trim(value) != nanoseconds)
        return std::nullopt;
    return std::chrono::duration_cast<Duration>(
        std::chrono::nanoseconds(static_cast<std::int64_t>(std::min<std::uint64_t>(*number, INT64_MAX))));
}

} // namespace

std::optional<DrmClient> parse_drm_client(std::string_view text)
{
    DrmClient client;
    bool has_id = false;
    bool has_engine = false;
    std::string_view driver;
    while (!text.empty()) {
        auto const line = text.substr(0, text.find('\n'));
        text.remove_prefix(std::min(line.size() + 1, text.size()));
        auto const colon = line.find(':');
        if (colon == std::string_view::npos)
            continue;
        auto const key = line.substr(0, colon);
        auto value = trim(line.substr(colon + 1));
        if (key == "drm-pdev") {
            client.device = value;
        } else if (key == "drm-driver") {
            driver = value;
        } else if (key == "drm-client-id") {
            auto const id = take_number(value);
            has_id = id.has_value();
            client.id = id.value_or(0);
        } else if (key.starts_with(engine) && !key.substr(engine.size()).starts_with(capacity)) {
            auto const busy = busy_time(value);
            has_engine = has_engine || busy.has_value();
            client.busy = std::max(client.busy, busy.value_or(Duration()));
        }
    }
    if (!has_id || !has_engine)
        return std::nullopt;
    // Only devices on a PCI bus have an address there; others go by their driver's name.
    if (client.device.empty())
        client.device = driver;
    return client;
}

} // namespace webots_cloud::core
