// Frames of browsers, and of simulators: the same in one piece as byte by byte, never longer than allowed,
// texts of well-formed UTF-8 or a fault.
#include "fuzz.hpp"

#include "adapters/messages/websocket_frames.hpp"

#include <string>
#include <vector>

using namespace webots_cloud;
using adapters::WebSocketEvent;
using Kind = WebSocketEvent::Kind;

namespace {

constexpr std::size_t longest = 4096;

std::vector<std::string> read(std::string_view text, std::size_t piece, adapters::WebSocketSide from)
{
    std::vector<std::string> found;
    adapters::WebSocketFrameReader reader(longest, from);
    while (!text.empty()) {
        auto bytes = fuzz::take(text, piece);
        while (!bytes.empty()) {
            auto const before = bytes.size();
            auto const event = reader.next(bytes);
            fuzz::require(bytes.size() <= before && event.payload.size() <= longest);
            if (event.kind == Kind::need_more)
                continue;
            found.push_back(std::to_string(static_cast<int>(event.kind)) +
                            std::to_string(static_cast<int>(event.code)) + event.payload);
            if (event.kind == Kind::fault)
                return found;
            fuzz::require(event.kind != Kind::message || bytes.size() < before);
        }
    }
    return found;
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    for (auto const from : {adapters::WebSocketSide::client, adapters::WebSocketSide::server})
        fuzz::require(read(text, size + 1, from) == read(text, 1, from));
    return 0;
}
