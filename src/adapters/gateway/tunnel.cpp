// Moves bytes of one browser and one server both ways. How much is read at once follows from what the other
// side takes: large pieces save wake-ups, but what is left over has been copied in vain
// (docs/gateway_costs.md).
#include "tunnel.hpp"

#include "adapters/messages/websocket_frames.hpp"

#include <algorithm>
#include <chrono>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {

namespace {

// Instead of `chunk_size`: for a side that does not take that much, as what it leaves has been copied in
// vain.
constexpr std::size_t modest_chunk = 64 * 1024;
// Of what comes by TLS: it has left the kernel, and what the other side leaves of it is kept.
constexpr std::size_t tls_chunk = 64 * 1024;
// What is read before it is known whether the other side takes it.
constexpr std::size_t small_chunk = 16 * 1024;

/// What has been read, as one message: its header is written before it, where there is room.
std::string_view framed(char* bytes, std::size_t size)
{
    auto const header = binary_frame_header(size);
    auto* const frame = std::copy_backward(header.begin(), header.end(), bytes);
    return {frame, header.size() + size};
}

} // namespace

Tunnels::Tunnel::Tunnel(Tunnels& owner, TunnelPlan plan)
    : owner_(owner), browser_(std::move(plan.browser)), upstream_(std::move(plan.upstream)),
      group_(std::move(plan.group)), ticket_(std::move(plan.ticket)), rest_(plan.length),
      chunks_(plan.chunks), is_two_way_(plan.is_two_way), in_messages_(plan.in_messages),
      keeps_upstream_(plan.keeps_upstream)
{
    browser_.pending = std::move(plan.to_browser);
    upstream_.pending = std::move(plan.to_upstream);
    take_from_rest(0);
    if (plan.chunks)
        take_chunks(*plan.chunks);
    upstream_.is_bulk = is_long();
    is_cut_ = group_ && !group_->join(*this);
}

Tunnels::Tunnel::~Tunnel()
{
    if (group_)
        group_->leave(*this);
}

void Tunnels::Tunnel::end()
{
    is_cut_ = true;
    owner_.schedule(*this);
}

/// It is known that there is much to come.
bool Tunnels::Tunnel::is_long() const noexcept
{
    return is_counted() && rest_ > small_chunk;
}

void Tunnels::Tunnel::take_from_rest(std::uint64_t bytes) noexcept
{
    if (!is_counted())
        return;
    rest_ -= bytes;
    upstream_.is_over = upstream_.is_over || rest_ == 0;
}

/// How far its body has come: what has been sent on, or is kept.
void Tunnels::Tunnel::take_chunks(core::ChunkedBody const& chunks)
{
    chunks_ = chunks;
    if (!chunks.is_over() || upstream_.is_over)
        return;
    upstream_.is_over = true;
    if (chunks.is_complete() && !browser_.end.is_broken())
        browser_.pending.append(core::ChunkedBody::end());
}

void Tunnels::Tunnel::count(Side const& to, std::size_t bytes) noexcept
{
    bool const is_sent = &to == &browser_;
    auto& statistics = owner_.statistics_;
    (is_sent ? statistics.tunnel_bytes_sent : statistics.tunnel_bytes_received) += bytes;
    if (!group_)
        return;
    if (is_sent)
        group_->count_sent(bytes);
    else
        group_->count_received(bytes);
}

/// Sends what is pending; how much of it.
std::size_t Tunnels::Tunnel::flush(Side& to)
{
    if (to.pending.empty() || !to.end.may_write())
        return 0;
    auto const sent = to.end.write(to.pending);
    count(to, sent);
    if (sent == to.pending.size())
        to.pending = std::string(); // and its memory
    else
        to.pending.erase(0, sent);
    return sent;
}

/// How much may be moved at once; 0: the group has moved what it may.
std::size_t Tunnels::Tunnel::share(Side const& from, Side const& to, std::size_t moved)
{
    auto size = !from.is_bulk ? small_chunk : from.end.is_tls() ? std::min(to.takes, tls_chunk) : to.takes;
    if (group_ && group_->has_limit())
        size = std::min(size, group_->allowance(std::chrono::steady_clock::now()));
    if (size == 0)
        return 0;
    auto const left = owner_.left_of_turn_ - std::min(owner_.left_of_turn_, moved);
    size = std::min(size, std::max(left, small_chunk));
    if (is_framed(from))
        return std::min(size, modest_chunk);
    return is_counted() && &from == &upstream_
               ? static_cast<std::size_t>(std::min<std::uint64_t>(size, rest_))
               : size;
}

/// Moves a chunk from one side to the other, where it is to be as one message.
Tunnels::Tunnel::Step Tunnels::Tunnel::relay(Side& from, Side& to, std::size_t& moved)
{
    // What is left of the last turn goes first, or bytes would change places.
    moved += flush(to);
    if (to.end.is_broken())
        to.pending = std::string(); // nobody is there to take it
    if (!to.pending.empty())
        return Step::wait;
    if (from.is_over) {
        if (!is_counted()) // else the browser's connection lives on, or is cut
            to.end.shut_down();
        return Step::wait;
    }
    if (!from.end.may_read() || (!to.end.may_write() && !to.end.is_broken()))
        return Step::wait;
    auto const size = share(from, to, moved);
    if (size == 0)
        return Step::pause;
    bool const in_frame = is_framed(from);
    // Bytes are taken out of the kernel after they have been sent on. So what the other side does not take
    // stays there, not with us; and the acknowledgement, which the kernel sends when bytes are taken out,
    // does not delay them. Of a frame that has begun, the rest has to be sent as it was.
    bool const peek = !in_frame && !from.end.is_tls() && !to.end.is_broken();
    std::size_t got = 0;
    auto* const bytes = owner_.scratch_.get() + (in_frame ? max_frame_header : 0);
    auto const reading = from.end.read(bytes, size, peek, got);
    if (reading == TunnelEnd::Reading::nothing)
        return Step::wait;
    if (reading == TunnelEnd::Reading::over) {
        if (in_frame)
            end_messages();
        from.is_over = true;
        return Step::again;
    }
    // A copy looks ahead: what the other side does not take now is read again later, and must not count
    // twice.
    auto chunks = &from == &upstream_ ? chunks_ : std::nullopt;
    if (chunks)
        got = chunks->take(std::string_view(bytes, got));
    auto const out = in_frame ? framed(bytes, got) : std::string_view(bytes, got);
    auto sent = out.size();
    if (!to.end.is_broken()) {
        sent = to.end.write(out);
        count(to, sent);
        moved += sent;
        // A side that does not take it all is offered less: of TLS no more than a record, which we keep.
        auto const least = from.end.is_tls() ? small_chunk : modest_chunk;
        if (size > small_chunk || from.end.is_tls())
            to.takes = std::clamp(sent < out.size() ? 2 * sent : 2 * to.takes, least, chunk_size);
        // TLS has begun to send a record, and must be given the same bytes again.
        auto const rest = out.size() - sent;
        auto const kept = !peek ? rest : to.end.is_tls() ? std::min(rest, small_chunk) : 0;
        to.pending.assign(out.data() + sent, kept);
        sent += kept;
    }
    if (peek)
        from.end.discard(bytes, sent, sent == got && got < size);
    bool const is_counted_side = is_counted() && &from == &upstream_;
    if (is_counted_side)
        take_from_rest(sent);
    // The copy is ahead of what was sent: again, from where we were, as far as that goes.
    if (chunks && sent < got) {
        chunks = chunks_;
        chunks->take(std::string_view(bytes, sent));
    }
    if (chunks) // also where nothing was taken: it may be known now that no chunk follows
        take_chunks(*chunks);
    // What comes in large pieces, or is known to be long, may be read in larger ones the next time.
    from.is_bulk = got >= small_chunk || (is_counted_side && is_long());
    // What ends a chunked body is written by us, and not known to the kernel yet: no event will tell of it.
    bool const is_ended = chunks && from.is_over;
    bool const is_taken = (to.pending.empty() || is_ended) && (to.end.may_write() || to.end.is_broken());
    return is_taken && (from.is_over || from.end.may_read()) ? Step::again : Step::wait;
}

void Tunnels::Tunnel::end_messages()
{
    constexpr std::uint16_t normal_closure = 1000;
    upstream_.is_over = true;
    append_close_frame(browser_.pending, normal_closure, {});
}

/// A page that gets messages says nothing before it wants no more of them.
void Tunnels::Tunnel::hear_browser()
{
    std::size_t got = 0;
    if (!upstream_.is_over && browser_.end.may_read() &&
        browser_.end.read(owner_.scratch_.get(), chunk_size, false, got) == TunnelEnd::Reading::some)
        end_messages();
}

/// What a browser still says when it has got all: unread, it would reset the connection.
void Tunnels::Tunnel::drain_browser() noexcept
{
    std::size_t got = 0;
    while (browser_.end.may_read() && !browser_.is_over)
        browser_.is_over =
            browser_.end.read(owner_.scratch_.get(), chunk_size, false, got) == TunnelEnd::Reading::over;
}

Tunnels::Tunnel::Step Tunnels::Tunnel::step(std::size_t& moved)
{
    if (is_cut_)
        return Step::over;
    if (in_messages_)
        hear_browser();
    auto next = relay(upstream_, browser_, moved);
    if (browser_.end.is_broken())
        return Step::over;
    // With a known length the browser's connection lives on once all has arrived. If the other server has
    // ended before that, cutting it is the only way to tell the browser.
    if (is_counted())
        return is_complete() || (upstream_.is_over && rest_ > 0) ? Step::over : next;
    if (is_two_way_) {
        auto const other = relay(browser_, upstream_, moved);
        next = next == Step::again || other == Step::again   ? Step::again
               : next == Step::pause || other == Step::pause ? Step::pause
                                                             : Step::wait;
    } else {
        // The browser has nothing to say here. What it says all the same is read at the end, since unread it
        // would reset the connection.
        moved += flush(upstream_);
        if (browser_.end.is_shut_down())
            drain_browser();
        else if (browser_.end.has_hung_up())
            upstream_.end.shut_down();
    }
    bool const is_over = upstream_.is_over && browser_.is_over && browser_.end.is_shut_down() &&
                         (upstream_.pending.empty() || upstream_.end.is_broken());
    return is_over ? Step::over : next;
}

bool Tunnels::Tunnel::is_overdue(TimePoint now, HttpServerParams const& params) const noexcept
{
    bool const is_stuck = !browser_.pending.empty() || !upstream_.pending.empty() ||
                          !browser_.end.may_write() || !upstream_.end.may_write();
    bool const is_half_closed = upstream_.is_over || browser_.is_over || upstream_.end.is_shut_down();
    auto const patience = is_stuck || is_half_closed ? params.write_timeout : params.tunnel_idle_timeout;
    return now - last_moved >= patience;
}

} // namespace webots_cloud::adapters
