// What tunnels to other servers have in common: see `Forward` in endpoint.hpp.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_set>

namespace WEBOTS_CLOUD_API webots_cloud {

/// What all tunnels to one simulation, say, share: their counts, a limit of their speed, and their end.
///
/// Lifetime: made with std::make_shared, since every tunnel holds it. Letting go of it ends no tunnel:
/// `close` does.
/// Thread-safety: one executor.
class TunnelGroup
{
public:
    /// `bytes_per_second`: see `set_limit`.
    explicit TunnelGroup(std::uint64_t bytes_per_second = 0) { set_limit(bytes_per_second); }
    TunnelGroup(TunnelGroup const&) = delete;
    TunnelGroup& operator=(TunnelGroup const&) = delete;

    std::uint64_t received() const noexcept { return received_; } ///< Bytes from browsers.
    std::uint64_t sent() const noexcept { return sent_; }         ///< Bytes to browsers.
    std::size_t open() const noexcept { return tunnels_.size(); } ///< Tunnels, and requests on their way.
    bool is_closed() const noexcept { return is_closed_; }        ///< To new tunnels.
    bool has_limit() const noexcept { return bytes_per_second_ > 0; }

    /// Refuses new tunnels; those that are open go on. `emptied` is called once, when the last of them has
    /// left; at once if there is none; not after `close`.
    void refuse_new(std::function<void()> emptied);

    /// Ends all tunnels, and refuses new ones.
    void close();

    /// For both directions of all tunnels together. 0: no limit.
    void set_limit(std::uint64_t bytes_per_second) noexcept;

    // For the adapter that relays

    /// A tunnel, or a request that may become one.
    ///
    /// Lifetime: must leave the group before it goes.
    class Tunnel
    {
    public:
        Tunnel() = default;

        /// The group was closed: the connections are to be closed. Destroys no tunnel, not even itself.
        virtual void end() = 0;

    protected:
        ~Tunnel() = default;
    };

    /// False when the group is closed.
    bool join(Tunnel& tunnel);
    void leave(Tunnel& tunnel) noexcept;

    /// How many bytes may be relayed now; 0: try again in `pause`.
    std::size_t allowance(TimePoint now) noexcept;
    static constexpr Duration pause = std::chrono::milliseconds(20);

    void count_received(std::uint64_t bytes) noexcept;
    void count_sent(std::uint64_t bytes) noexcept;

private:
    std::unordered_set<Tunnel*> tunnels_;
    std::function<void()> emptied_;
    std::uint64_t received_ = 0;
    std::uint64_t sent_ = 0;
    double bytes_per_second_ = 0;
    double burst_ = 0;
    double tokens_ = 0; ///< Bytes that may be relayed; negative after more than was allowed.
    TimePoint filled_ = TimePoint::min();
    bool is_closed_ = false;
};

} // namespace webots_cloud
