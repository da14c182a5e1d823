// The frames of WebSockets (RFC 6455, 5): bytes of the other side in, messages out, and frames for it. No
// sockets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// Who sends a frame: clients mask theirs, servers do not.
enum class WebSocketSide : bool
{
    client,
    server
};

/// Close codes that a server sends (RFC 6455, 7.4.1).
enum class CloseCode : std::uint16_t
{
    none = 0, ///< A close frame without code.
    going_away = 1001,
    protocol_error = 1002,
    bad_payload = 1007,
    too_big = 1009
};

/// What the next bytes of the other side, mostly a browser, mean.
struct WebSocketEvent
{
    enum class Kind
    {
        need_more,
        message, ///< `payload` is a whole message.
        ping,
        pong,
        close, ///< `code` is what the browser said.
        fault  ///< The browser breaks the protocol or a limit: `code` is to be sent, and nothing more to be
               ///< read.
    };

    WebSocketEvent(Kind kind = Kind::need_more) : kind(kind) {}

    Kind kind;
    std::string payload;
    CloseCode code = CloseCode::none;
};

/// Small on purpose: a silent browser costs only these few words of memory, and no buffer.
class WebSocketFrameReader
{
public:
    explicit WebSocketFrameReader(std::size_t max_message_size, WebSocketSide from = WebSocketSide::client)
        : max_message_size_(max_message_size), from_(from)
    {}

    /// The next event in `bytes`, of which what was used is removed. To be called until it needs more.
    WebSocketEvent next(std::string_view& bytes);

private:
    bool read_header(std::string_view& bytes);
    CloseCode check_header();
    void read_payload(std::string_view& bytes);
    WebSocketEvent finish_frame();
    WebSocketEvent finish_close();
    WebSocketEvent fail(CloseCode code) const;

    bool is_control() const noexcept { return (opcode_ & 0x8) != 0; }
    bool is_masked() const noexcept { return from_ == WebSocketSide::client; }
    std::size_t header_size() const noexcept;
    std::uint8_t byte(std::size_t index) const noexcept { return header_[index]; }

    std::size_t max_message_size_;
    std::string message_;       ///< The fragments so far.
    std::string control_;       ///< A control frame may come between fragments.
    std::uint64_t missing_ = 0; ///< Bytes of the current frame's payload.
    std::uint32_t fragments_ = 0;
    std::array<std::uint8_t, 14> header_{};
    std::uint8_t header_bytes_ = 0;
    std::uint8_t opcode_ = 0;         ///< Of the current frame.
    std::uint8_t message_opcode_ = 0; ///< Of the message that the fragments belong to; 0: none.
    std::uint8_t mask_at_ = 0;
    bool in_payload_ = false;
    WebSocketSide from_;
};

/// What comes before the bytes of a binary message of that size, in a frame of a server: 10 bytes at most.
std::string binary_frame_header(std::size_t size);
inline constexpr std::size_t max_frame_header = 10;

/// Appends a whole frame.
void append_text_frame(std::string& out, std::string_view text, WebSocketSide from = WebSocketSide::server);
void append_ping_frame(std::string& out);
void append_pong_frame(std::string& out, std::string_view payload,
                       WebSocketSide from = WebSocketSide::server);
/// A `reason` longer than 123 bytes is cut.
void append_close_frame(std::string& out, std::uint16_t code, std::string_view reason,
                        WebSocketSide from = WebSocketSide::server);

} // namespace webots_cloud::adapters
