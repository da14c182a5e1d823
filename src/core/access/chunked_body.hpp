// Finds the end of a body that is sent in chunks (RFC 9112, 7.1) while a gateway passes it on, so that
// nothing that follows it is passed on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace webots_cloud::core {

/// Follows a body from its first byte on. The chunks themselves are not looked at.
class ChunkedBody
{
public:
    /// How many of the next bytes belong to the body, up to and including the line of the last chunk, which
    /// is where the caller ends it with `end()`: trailer fields, which browsers do not use, are left out.
    /// Fewer than there are: the body is over.
    std::size_t take(std::string_view bytes) noexcept;

    /// What follows the line of the last chunk.
    static constexpr std::string_view end() noexcept { return "\r\n"; }

    bool is_complete() const noexcept { return state_ == State::complete; }
    /// No chunk begins where one should.
    bool is_malformed() const noexcept { return state_ == State::malformed; }
    bool is_over() const noexcept { return is_complete() || is_malformed(); }

private:
    enum class State : std::uint8_t
    {
        size,      ///< The digits of a chunk's size.
        extension, ///< What follows them in their line.
        line_feed, ///< Which ends the line.
        data,
        data_return, ///< The line break after the data.
        data_line_feed,
        complete,
        malformed
    };

    State next(char byte) noexcept;

    std::uint64_t left_ = 0; ///< Of the chunk: its size, until its data has begun.
    std::uint16_t line_ = 0; ///< Bytes of its line so far.
    State state_ = State::size;
};

} // namespace webots_cloud::core
