// The heads of requests that are passed on to another server, and of its answers. No sockets.
#pragma once

#include "http_request_reader.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace webots_cloud::adapters {

/// What another server may say before the body of its answer: more than any that people use.
inline constexpr std::size_t max_response_head = 32 * 1024;

/// The head that the other server is sent: written anew from what the reader has understood, so that the two
/// can't disagree about where the request ends. `request` is the reader's, and says who asks. `keep_alive`:
/// another one may follow.
std::string forwarded_request(HttpRequestReader const& reader, IncomingRequest const& request,
                              Forward const& forward, bool keep_alive);

/// The head of the other server's answer.
class ForwardedResponse
{
public:
    enum class Progress
    {
        need_more,
        complete,
        malformed ///< Or too large.
    };
    /// How the end of the body is told.
    enum class Body
    {
        none,
        counted,  ///< `length()` bytes.
        chunked,  ///< By itself (RFC 9112, 7.1).
        endless,  ///< By the end of the connection.
        websocket ///< It is none: both sides may say what they like.
    };

    /// `kind`: who answers; `is_head`: the request was HEAD; `is_upgrade`: a WebSocket handshake.
    ForwardedResponse(UpstreamKind kind, bool is_head, bool is_upgrade)
        : kind_(kind), is_head_(is_head), is_upgrade_(is_upgrade)
    {}

    /// Tries to complete the head with all that was received so far. The text must outlive the use of what it
    /// finds.
    Progress parse(std::string_view received);

    int status() const noexcept { return status_; }
    Body body() const noexcept { return body_; }
    std::uint64_t length() const noexcept { return body_ == Body::counted ? *length_ : 0; }

    /// The other server takes another request on the same connection.
    bool keeps_connection() const noexcept { return keeps_connection_; }

    /// How much of what was received is head.
    std::size_t head_size() const noexcept { return head_size_; }

    /// Adds a header, unless the other server sent one of this name.
    void add_missing(std::string_view name, std::string_view value);

    /// Adds a header whatever the other server says; not to the answer to an accepted handshake.
    void add(std::string_view name, std::string_view value);

    /// Appends the head for the browser, whose connection stays open or not.
    void append_head(std::string& out, bool keep_alive) const;

private:
    class Parser;

    bool has(std::string_view name) const;
    void find_body(bool is_chunked, std::optional<std::uint64_t> length);

    UpstreamKind kind_;
    bool is_head_;
    bool is_upgrade_;
    bool is_coded_ = false; ///< There is a `Transfer-Encoding`.
    bool keeps_connection_ = false;
    int status_ = 0;
    Body body_ = Body::none;
    std::optional<std::uint64_t> length_; ///< As the other server says, also where there is no body.
    std::size_t head_size_ = 0;
    std::string reason_;
    std::vector<std::pair<std::string, std::string>> fields_;
    std::vector<std::pair<std::string, std::string>> added_;
};

} // namespace webots_cloud::adapters
