#include "simulator_greeting.hpp"

#include "core/text.hpp"
#include "launch_plan.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace webots_cloud::core {
namespace {

// A session server that relays takes 64 KiB at once. Of more lines the first are what a page needs.
constexpr std::size_t max_said = std::size_t{16} << 10;
constexpr std::size_t max_all_said = std::size_t{64} << 10;

bool is_said_once(std::string_view message)
{
    constexpr std::array<std::string_view, 3> kinds{"stdout:", "stderr:", "robot:"};
    return std::any_of(kinds.begin(), kinds.end(),
                       [message](std::string_view kind) { return message.starts_with(kind); });
}

/// Not within a character.
std::string_view cut(std::string_view text, std::size_t size)
{
    constexpr unsigned mask = 0xc0;
    constexpr unsigned continuation = 0x80;
    if (text.size() <= size)
        return text;
    while (size > 0 && (static_cast<unsigned char>(text[size]) & mask) == continuation)
        --size;
    return text.substr(0, size);
}

} // namespace

std::optional<SimulatorGreeting> greeting_for(SimulationRequest const& request)
{
    auto const* const start = std::get_if<StartMessage>(&request);
    if (!start || !is_video(start->mode) || start->picture_size.empty())
        return std::nullopt;
    SimulatorGreeting greeting;
    greeting.picture_size = start->picture_size;
    // It is paused: to pause it once more changes nothing, and is answered.
    greeting.words = {concat("mjpeg: ", start->picture_size), start->runs ? "real-time:-1" : "pause"};
    greeting.last = start->runs ? "real-time" : "paused by client";
    return greeting;
}

bool is_answered(SimulatorGreeting const& greeting, std::vector<std::string> const& heard)
{
    return std::find(heard.begin(), heard.end(), greeting.last) != heard.end();
}

std::vector<std::string> said_messages(std::vector<std::string> const& heard)
{
    std::vector<std::string> messages;
    std::size_t left = max_all_said;
    for (auto const& text : heard) {
        if (!is_said_once(text))
            continue;
        auto message = said_message(cut(text, max_said));
        auto const kept = message.size() + sizeof message; // short ones take memory, too
        if (kept > left)
            break;
        left -= kept;
        messages.push_back(std::move(message));
    }
    return messages;
}

} // namespace webots_cloud::core
