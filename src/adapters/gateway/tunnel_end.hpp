// One of the two connections of a tunnel.
#pragma once

#include "adapters/network/network_stream.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// A connection without an event loop of its own: reads and writes at once, and remembers what may be tried
/// again after the kernel has said so (`notice`).
class TunnelEnd
{
public:
    enum class Reading : std::uint8_t
    {
        some,
        nothing, ///< For now.
        over     ///< Nothing more will come.
    };

    explicit TunnelEnd(NetworkStream::Released connection) noexcept : connection_(std::move(connection)) {}
    TunnelEnd(TunnelEnd const&) = delete;
    TunnelEnd& operator=(TunnelEnd const&) = delete;
    ~TunnelEnd() { close(); }

    int descriptor() const noexcept { return connection_.descriptor; }
    bool is_tls() const noexcept { return connection_.tls != nullptr; }

    /// What the kernel has said (EPOLLIN and so on).
    void notice(std::uint32_t events) noexcept;

    bool may_read() const noexcept { return may_read_; }
    bool may_write() const noexcept { return may_write_; }

    /// The peer has closed its side, or all of the connection; there may be bytes to read before.
    bool has_hung_up() const noexcept { return has_hung_up_; }
    /// Nothing can be sent either.
    bool is_broken() const noexcept { return is_broken_; }

    /// Up to `size` bytes. `peek`: they stay where they are, until `discard`; not with TLS.
    Reading read(char* to, std::size_t size, bool peek, std::size_t& read) noexcept;

    /// Forgets this many bytes of those that a peek has shown. `is_all`: there were no more.
    void discard(char* scratch, std::size_t size, bool is_all) noexcept;

    /// What could be sent of it at once; less than all: `may_write` is false from then on, or `is_broken`
    /// true. With TLS what was left must be sent next.
    std::size_t write(std::string_view bytes) noexcept;

    /// Nothing more will be written.
    void shut_down() noexcept;
    bool is_shut_down() const noexcept { return is_shut_down_; }

    void close() noexcept;
    NetworkStream::Released release() noexcept;

private:
    Reading read_tls(char* to, std::size_t size, std::size_t& read) noexcept;
    std::size_t write_tls(std::string_view bytes) noexcept;

    NetworkStream::Released connection_;
    bool may_read_ = true;
    bool may_write_ = true;
    bool has_hung_up_ = false;
    bool is_broken_ = false;
    bool is_shut_down_ = false;
};

} // namespace webots_cloud::adapters
