// One browser and its connection to another server. For the files of Tunnels alone.
#pragma once

#include "tunnels.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

/// One browser and its connection to another server.
class Tunnels::Tunnel final : public TunnelGroup::Tunnel
{
public:
    /// What is read at once when there is much: all that a simulator has sent since the last look, as a rule.
    /// Each piece that is sent on wakes the browser, and each that is taken the simulator, which costs as
    /// much as copying.
    static constexpr std::size_t chunk_size = 256 * 1024;

    struct Side
    {
        explicit Side(NetworkStream::Released connection) noexcept : end(std::move(connection)) {}

        TunnelEnd end;
        std::string pending;            ///< To be sent there before anything else.
        bool is_over = false;           ///< Nothing more comes from there.
        bool is_bulk = false;           ///< The last read gave much.
        std::size_t takes = chunk_size; ///< Of a large chunk, to judge by the last one.
    };

    enum class Step
    {
        wait,  ///< For an event.
        again, ///< There is more to do at once.
        pause, ///< The group has moved what it may.
        over
    };

    Tunnel(Tunnels& owner, TunnelPlan plan);
    Tunnel(Tunnel const&) = delete;
    Tunnel& operator=(Tunnel const&) = delete;
    ~Tunnel();

    void end() override;

    bool is_cut() const noexcept { return is_cut_; }

    /// Moves a chunk in each direction at most; `moved` is how much that was.
    Step step(std::size_t& moved);

    /// Silent, or stuck, for too long.
    bool is_overdue(TimePoint now, HttpServerParams const& params) const noexcept;

    Side& browser() noexcept { return browser_; }
    Side& upstream() noexcept { return upstream_; }

    /// The browser has got all that it was to get, and its connection is its own again.
    bool is_complete() const noexcept { return rest_ == 0 && browser_.pending.empty() && !is_cut_; }
    /// Whether the other server's connection is to live on as well, and does.
    bool keeps_upstream() const noexcept { return keeps_upstream_ && !upstream_.end.has_hung_up(); }

    List::iterator self;
    bool is_scheduled = false;
    bool has_moved = false; ///< Since the last `check`.
    TimePoint last_moved{}; ///< When a `check` found that it had: so no picture waits for a clock.
    // Of `relay`; null: of `open`.
    Ends* outcome = nullptr;
    async::Wakeup* done = nullptr;
    Tunnel** handle = nullptr; ///< Points here as long as there is a tunnel.

private:
    bool is_counted() const noexcept { return rest_ != TunnelPlan::until_the_end; }
    bool is_long() const noexcept;
    /// What comes from there is sent on as messages.
    bool is_framed(Side const& from) const noexcept { return in_messages_ && &from == &upstream_; }
    void take_from_rest(std::uint64_t bytes) noexcept;
    void take_chunks(core::ChunkedBody const& chunks);
    std::size_t flush(Side& to);
    Step relay(Side& from, Side& to, std::size_t& moved);
    std::size_t share(Side const& from, Side const& to, std::size_t moved);
    void end_messages();
    void hear_browser();
    void count(Side const& to, std::size_t bytes) noexcept;
    void drain_browser() noexcept;

    Tunnels& owner_;
    Side browser_;
    Side upstream_;
    std::shared_ptr<TunnelGroup> group_;
    ConnectionLimit::Ticket ticket_;
    std::uint64_t rest_;
    std::optional<core::ChunkedBody> chunks_;
    bool is_two_way_;
    bool in_messages_;
    bool keeps_upstream_;
    bool is_cut_ = false;
};

} // namespace webots_cloud::adapters
