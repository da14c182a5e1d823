// pkt-lines, the frames of git's protocol: four hexadecimal digits of length, then that many bytes less four.
#pragma once

#include <webots_cloud/error.hpp>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace webots_cloud::core {

struct PktLine
{
    enum class Kind
    {
        data,
        flush,       ///< `0000`: the end of a message.
        delimiter,   ///< `0001`: between the sections of a message.
        response_end ///< `0002`: the end of a stateless answer.
    };

    Kind kind = Kind::data;
    std::string_view payload; ///< Of `data`; may be empty.

    /// The payload without a newline at its end.
    std::string_view text() const noexcept
    {
        return payload.ends_with('\n') ? payload.substr(0, payload.size() - 1) : payload;
    }
};

/// One frame.   Precondition: at most 65,516 bytes of payload.
std::string pkt_line(std::string_view payload);

constexpr std::string_view pkt_flush = "0000";
constexpr std::string_view pkt_delimiter = "0001";

/// What a git server says in an error, without the newlines and zero bytes that some of them send at its end.
std::string_view git_server_words(std::string_view text) noexcept;

/// Takes frames out of a stream that arrives in arbitrary pieces.
class PktLineDecoder
{
public:
    void push(std::string_view bytes);

    /// The next whole frame, or nothing until more bytes come. Its payload is valid until the next call of
    /// anything.
    ///
    /// Errors: `malformed` for a length that is none.
    result<std::optional<PktLine>> next();

    /// True when the stream may end here: no part of a frame is left.
    bool at_boundary() const noexcept { return start_ == buffer_.size(); }

private:
    std::string buffer_;
    std::size_t start_ = 0;
};

} // namespace webots_cloud::core
