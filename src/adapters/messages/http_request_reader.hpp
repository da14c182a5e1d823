// Reads the heads of HTTP requests from the bytes of a connection, with limits. No sockets: bytes in,
// requests out.
#pragma once

#include <webots_cloud/transport/endpoint.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {

/// Similar to the limits of nginx, with which browsers and proxies work.
inline constexpr std::size_t max_request_line = 8 * 1024;
inline constexpr std::size_t max_header_size = 16 * 1024; ///< All fields together, without the request line.
inline constexpr std::size_t max_header_fields = 100;

/// Beast's parser reads the grammar; here are the buffer, the limits, and the status of what is refused. The
/// fields stay where the network put them, and nothing is allocated from the second request of a connection
/// on: the whole of `GET /session` may cost no more than 5 microseconds.
class HttpRequestReader
{
public:
    enum class Progress
    {
        need_more, ///< The head is not complete.
        complete,  ///< `request()` is valid until the next call of `next()`.
        /// As `complete`, and `body_length()` bytes follow. A caller that takes none answers 413 and closes.
        with_body,
        refused ///< `refusal()` is the status to answer; then the connection must be closed.
    };

    /// Room for bytes from the network; then `commit` what came.
    std::span<char> prepare();
    void commit(std::size_t size) noexcept { end_ += size; }

    /// Tries to complete the head with what was received.
    Progress parse();

    /// Forgets the current request and begins the next, which may have been received already (pipelining).
    void next() noexcept;

    /// Forgets everything that was received.
    void discard() noexcept { begin_ = end_ = head_ = 0; }

    /// True when a part of a request was received.
    bool has_begun() const noexcept { return end_ > begin_; }

    int refusal() const noexcept { return refusal_; }

    /// Of the current request, in bytes.
    std::uint64_t body_length() const noexcept { return body_length_; }

    /// Leaves out the first bytes of `rest()`, since they were part of the body.
    void skip(std::size_t size) noexcept { head_ += size; }

    /// What is known of the connection, and `upgrade`, are the caller's to fill.
    IncomingRequest const& request() const noexcept { return request_; }

    /// Whether the client wants to go on with this connection.
    bool keep_alive() const noexcept { return keep_alive_; }

    bool is_http_1_0() const noexcept { return is_http_1_0_; }

    /// There is an Upgrade field that counts (HTTP/1.0 has none).
    bool wants_upgrade() const noexcept { return has_upgrade_ && !is_http_1_0_; }

    /// "upgrade" is among the options of the Connection fields.
    bool connection_upgrades() const noexcept { return connection_upgrades_; }

    /// A proxy says for whom it asks, or somebody claims so.
    bool is_forwarded() const noexcept { return is_forwarded_; }

    /// What was received after the current request.
    std::string_view rest() const noexcept { return received().substr(head_); }

private:
    std::string_view received() const noexcept { return {buffer_.get() + begin_, end_ - begin_}; }
    Progress refuse(int status) noexcept;
    Progress refuse_incomplete_line() noexcept;
    int read_head(std::string_view head);

    class Parser;

    std::unique_ptr<char[]> buffer_;
    std::size_t capacity_ = 0;
    std::size_t begin_ = 0; ///< Of the current request.
    std::size_t end_ = 0;   ///< Of what was received.
    std::size_t head_ =
        0; ///< Length of the current request's head, once it is complete, and of what was skipped.
    std::size_t line_ = 0; ///< Length of its request line with CRLF, once that is complete.
    std::size_t seen_ =
        0; ///< So many of its bytes hold no end: a slow sender is not searched again and again.
    std::vector<std::pair<std::string_view, std::string_view>> fields_;
    IncomingRequest request_;
    int refusal_ = 0;
    std::uint64_t body_length_ = 0;
    bool has_strange_body_ = false; ///< One that can't be taken: its length is unknown, or said twice.
    bool is_http_1_0_ = false;
    bool keep_alive_ = false;
    bool has_upgrade_ = false;
    bool connection_upgrades_ = false;
    bool is_forwarded_ = false;
};

} // namespace webots_cloud::adapters
