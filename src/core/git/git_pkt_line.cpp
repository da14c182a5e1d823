#include "git_pkt_line.hpp"

#include "git_problem.hpp"

#include <algorithm>
#include <cassert>
#include <charconv>

namespace webots_cloud::core {
namespace {

constexpr std::size_t header_size = 4;
constexpr std::size_t max_frame_size = 65520; // gitprotocol-common(5)

} // namespace

std::string pkt_line(std::string_view payload)
{
    auto const length = payload.size() + header_size;
    assert(length <= max_frame_size);
    constexpr char digits[] = "0123456789abcdef";
    std::string frame;
    frame.reserve(length);
    for (int shift = 12; shift >= 0; shift -= 4)
        frame += digits[(length >> shift) & 15];
    return frame.append(payload);
}

std::string_view git_server_words(std::string_view text) noexcept
{
    constexpr std::string_view blank(" \t\r\n\0", 5);
    auto const first = std::min(text.find_first_not_of(blank), text.size());
    auto const last = text.find_last_not_of(blank);
    return last == std::string_view::npos ? std::string_view() : text.substr(first, last + 1 - first);
}

void PktLineDecoder::push(std::string_view bytes)
{
    buffer_.erase(0, start_);
    start_ = 0;
    buffer_.append(bytes);
}

result<std::optional<PktLine>> PktLineDecoder::next()
{
    auto const rest = std::string_view(buffer_).substr(start_);
    if (rest.size() < header_size)
        return std::optional<PktLine>();
    std::size_t length = 0;
    auto const [end, failed] = std::from_chars(rest.data(), rest.data() + header_size, length, 16);
    if (failed != std::errc() || end != rest.data() + header_size || length == 3 || length > max_frame_size)
        return Failure(GitProblem::malformed, "the git server sent a frame without a length");
    PktLine line;
    if (length < header_size) {
        line.kind = static_cast<PktLine::Kind>(length + 1);
        start_ += header_size;
        return std::optional(line);
    }
    if (rest.size() < length)
        return std::optional<PktLine>();
    line.payload = rest.substr(header_size, length - header_size);
    start_ += length;
    return std::optional(line);
}

} // namespace webots_cloud::core
