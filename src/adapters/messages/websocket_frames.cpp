// Reads frames without keeping any: the caller has the bytes. What a browser never does (large control
// frames, thousands of fragments) ends the connection.
#include "websocket_frames.hpp"

#include "core/text.hpp"

#include <algorithm>
#include <utility>

namespace webots_cloud::adapters {
namespace {

constexpr std::uint8_t continuation = 0x0;
constexpr std::uint8_t text = 0x1;
constexpr std::uint8_t binary = 0x2;
constexpr std::uint8_t close = 0x8;
constexpr std::uint8_t ping = 0x9;
constexpr std::uint8_t pong = 0xa;

constexpr std::uint8_t final_bit = 0x80;
constexpr std::uint8_t reserved_bits = 0x70;
constexpr std::uint8_t mask_bit = 0x80;
constexpr std::size_t max_control_size = 125;
constexpr std::size_t mask_size = 4;
// Masks protect proxies from what pages write, and we are no page: always the same one will do. Qt takes one
// of zeros for none.
constexpr std::string_view own_mask = "mask";

// Fragments cost time even when they are empty: no browser sends as many.
constexpr std::uint32_t max_fragments = 4096;

/// Codes that a peer may send (RFC 6455, 7.4).
bool is_close_code(unsigned code) noexcept
{
    return (code >= 1000 && code <= 1014 && code != 1004 && code != 1005 && code != 1006) ||
           (code >= 3000 && code <= 4999);
}

void append_header(std::string& out, std::uint8_t opcode, std::size_t size, WebSocketSide from)
{
    unsigned const masked = from == WebSocketSide::client ? mask_bit : 0;
    out.push_back(static_cast<char>(final_bit | opcode));
    if (size <= max_control_size) {
        out.push_back(static_cast<char>(masked | size));
    } else {
        bool const is_short = size <= 0xffff;
        out.push_back(static_cast<char>(masked | (is_short ? 126 : 127)));
        for (int shift = is_short ? 8 : 56; shift >= 0; shift -= 8)
            out.push_back(static_cast<char>(size >> shift & 0xff));
    }
    if (masked != 0)
        out.append(own_mask);
}

void append_frame(std::string& out, std::uint8_t opcode, std::string_view payload, WebSocketSide from)
{
    append_header(out, opcode, payload.size(), from);
    auto const begin = out.size();
    out.append(payload);
    if (from == WebSocketSide::client)
        for (std::size_t i = 0; i < payload.size(); ++i)
            out[begin + i] = static_cast<char>(out[begin + i] ^ own_mask[i % mask_size]);
}

} // namespace

WebSocketEvent WebSocketFrameReader::fail(CloseCode code) const
{
    WebSocketEvent event(WebSocketEvent::Kind::fault);
    event.code = code;
    return event;
}

WebSocketEvent WebSocketFrameReader::next(std::string_view& bytes)
{
    if (!in_payload_) {
        if (!read_header(bytes))
            return {};
        if (auto const code = check_header(); code != CloseCode::none)
            return fail(code);
        in_payload_ = true;
        mask_at_ = 0;
    }
    read_payload(bytes);
    if (missing_ > 0)
        return {};
    in_payload_ = false;
    header_bytes_ = 0;
    return finish_frame();
}

std::size_t WebSocketFrameReader::header_size() const noexcept
{
    if (header_bytes_ < 2)
        return 2;
    auto const length = byte(1) & 0x7f;
    std::size_t const extended = length == 126 ? 2 : length == 127 ? 8 : 0;
    return 2 + extended + (byte(1) & mask_bit ? mask_size : 0);
}

bool WebSocketFrameReader::read_header(std::string_view& bytes)
{
    while (header_bytes_ < header_size()) {
        if (bytes.empty())
            return false;
        header_[header_bytes_++] = static_cast<std::uint8_t>(bytes.front());
        bytes.remove_prefix(1);
    }
    return true;
}

CloseCode WebSocketFrameReader::check_header()
{
    opcode_ = byte(0) & 0x0f;
    bool const is_final = byte(0) & final_bit;
    auto const length = byte(1) & 0x7f;
    bool const has_mask = byte(1) & mask_bit;
    // RFC 6455, 5.2: no extensions were agreed on, clients mask, and other opcodes have no meaning yet.
    if ((byte(0) & reserved_bits) || has_mask != is_masked() || (opcode_ > binary && opcode_ < close) ||
        opcode_ > pong)
        return CloseCode::protocol_error;
    missing_ = static_cast<std::uint64_t>(length);
    if (length > static_cast<int>(max_control_size)) {
        missing_ = 0;
        auto const end = header_size() - (is_masked() ? mask_size : 0);
        for (std::size_t i = 2; i < end; ++i)
            missing_ = missing_ << 8 | byte(i);
    }
    // Control frames come as a whole, also between the fragments of a message.
    if (is_control())
        return !is_final || missing_ > max_control_size ? CloseCode::protocol_error : CloseCode::none;
    // Only what has begun can go on, and only what has ended is followed by another message.
    if ((opcode_ == continuation) != (message_opcode_ != 0))
        return CloseCode::protocol_error;
    if (opcode_ != continuation) {
        message_opcode_ = opcode_;
        fragments_ = 0;
    }
    bool const fits = missing_ <= max_message_size_ - message_.size() && ++fragments_ <= max_fragments;
    return fits ? CloseCode::none : CloseCode::too_big;
}

void WebSocketFrameReader::read_payload(std::string_view& bytes)
{
    auto const size = static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), missing_));
    auto& payload = is_control() ? control_ : message_;
    auto const before = payload.size();
    payload.append(bytes.substr(0, size));
    if (is_masked()) {
        auto const* const mask = header_.data() + header_bytes_ - mask_size;
        for (std::size_t i = 0; i < size; ++i)
            payload[before + i] =
                static_cast<char>(static_cast<std::uint8_t>(bytes[i]) ^ mask[(mask_at_ + i) & 3]);
        mask_at_ = static_cast<std::uint8_t>((mask_at_ + size) & 3);
    }
    missing_ -= size;
    bytes.remove_prefix(size);
}

WebSocketEvent WebSocketFrameReader::finish_frame()
{
    if (opcode_ == close)
        return finish_close();
    if (is_control()) {
        WebSocketEvent event(opcode_ == ping ? WebSocketEvent::Kind::ping : WebSocketEvent::Kind::pong);
        event.payload = std::exchange(control_, {});
        return event;
    }
    if (!(byte(0) & final_bit))
        return {WebSocketEvent::Kind::need_more};
    if (message_opcode_ == text && !core::is_utf8(message_))
        return fail(CloseCode::bad_payload);
    message_opcode_ = 0;
    WebSocketEvent event(WebSocketEvent::Kind::message);
    event.payload = std::exchange(message_, {});
    return event;
}

WebSocketEvent WebSocketFrameReader::finish_close()
{
    WebSocketEvent event(WebSocketEvent::Kind::close);
    auto const payload = std::exchange(control_, {});
    if (payload.empty())
        return event;
    if (payload.size() == 1)
        return fail(CloseCode::protocol_error);
    auto const at = [&payload](std::size_t i) {
        return static_cast<unsigned>(static_cast<std::uint8_t>(payload[i]));
    };
    auto const code = at(0) << 8 | at(1);
    if (!is_close_code(code))
        return fail(CloseCode::protocol_error);
    if (!core::is_utf8(std::string_view(payload).substr(2)))
        return fail(CloseCode::bad_payload);
    event.code = static_cast<CloseCode>(code);
    return event;
}

std::string binary_frame_header(std::size_t size)
{
    std::string header;
    append_header(header, binary, size, WebSocketSide::server);
    return header;
}

void append_text_frame(std::string& out, std::string_view message, WebSocketSide from)
{
    append_frame(out, text, message, from);
}

void append_ping_frame(std::string& out)
{
    append_frame(out, ping, {}, WebSocketSide::server);
}

void append_pong_frame(std::string& out, std::string_view payload, WebSocketSide from)
{
    append_frame(out, pong, payload, from);
}

void append_close_frame(std::string& out, std::uint16_t code, std::string_view reason, WebSocketSide from)
{
    std::string payload;
    if (code != 0) {
        payload.push_back(static_cast<char>(code >> 8));
        payload.push_back(static_cast<char>(code & 0xff));
        payload.append(reason.substr(0, max_control_size - 2));
    }
    append_frame(out, close, payload, from);
}

} // namespace webots_cloud::adapters
