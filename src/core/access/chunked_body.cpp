#include "chunked_body.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::uint16_t longest_line = 256; // nobody uses more for extensions
constexpr std::uint64_t largest_chunk = std::uint64_t(1) << 56;

} // namespace

std::size_t ChunkedBody::take(std::string_view bytes) noexcept
{
    std::size_t taken = 0;
    while (taken < bytes.size() && !is_over()) {
        if (state_ == State::data) {
            auto const part = std::min<std::uint64_t>(left_, bytes.size() - taken);
            taken += static_cast<std::size_t>(part);
            left_ -= part;
            if (left_ == 0)
                state_ = State::data_return;
            continue;
        }
        state_ = next(bytes[taken]);
        taken += state_ == State::malformed ? 0 : 1;
    }
    return taken;
}

ChunkedBody::State ChunkedBody::next(char byte) noexcept
{
    switch (state_) {
    case State::size:
    case State::extension: {
        if (++line_ > longest_line || byte == '\n')
            return State::malformed;
        if (byte == '\r')
            return line_ > 1 ? State::line_feed : State::malformed;
        if (state_ == State::extension)
            return State::extension;
        if (auto const digit = hex_digit(byte); digit >= 0) {
            left_ = 16 * left_ + static_cast<unsigned>(digit);
            return left_ <= largest_chunk ? State::size : State::malformed;
        }
        bool const may_follow = line_ > 1 && (byte == ';' || byte == ' ' || byte == '\t');
        return may_follow ? State::extension : State::malformed;
    }
    case State::line_feed:
        line_ = 0;
        return byte != '\n' ? State::malformed : left_ > 0 ? State::data : State::complete;
    case State::data_return:
        return byte == '\r' ? State::data_line_feed : State::malformed;
    case State::data_line_feed:
        return byte == '\n' ? State::size : State::malformed;
    default:
        return state_;
    }
}

} // namespace webots_cloud::core
