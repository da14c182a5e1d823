#include <webots_cloud/transport/tunnel_group.hpp>

#include <algorithm>
#include <utility>

namespace webots_cloud {
namespace {

// What may pass at once after a silence: a quarter of a second's bytes.
constexpr double burst_seconds = 0.25;
// Less is not worth a turn of the event loop: a tunnel at the limit would otherwise relay a few bytes a turn,
// without end.
constexpr double min_portion = 4096;

} // namespace

void TunnelGroup::set_limit(std::uint64_t bytes_per_second) noexcept
{
    bytes_per_second_ = static_cast<double>(bytes_per_second);
    burst_ = std::max(min_portion, bytes_per_second_ * burst_seconds);
    tokens_ = burst_;
}

bool TunnelGroup::join(Tunnel& tunnel)
{
    if (!is_closed_)
        tunnels_.insert(&tunnel);
    return !is_closed_;
}

void TunnelGroup::leave(Tunnel& tunnel) noexcept
{
    tunnels_.erase(&tunnel);
    if (tunnels_.empty() && emptied_)
        std::exchange(emptied_, nullptr)();
}

void TunnelGroup::refuse_new(std::function<void()> emptied)
{
    is_closed_ = true;
    if (tunnels_.empty())
        emptied();
    else
        emptied_ = std::move(emptied);
}

void TunnelGroup::close()
{
    emptied_ = nullptr;
    is_closed_ = true;
    while (!tunnels_.empty()) { // they leave while they end, and perhaps not they alone
        auto* const tunnel = *tunnels_.begin();
        tunnels_.erase(tunnels_.begin());
        tunnel->end();
    }
}

std::size_t TunnelGroup::allowance(TimePoint now) noexcept
{
    if (bytes_per_second_ <= 0)
        return SIZE_MAX;
    if (filled_ != TimePoint::min()) {
        std::chrono::duration<double> const passed = now - filled_;
        tokens_ = std::min(burst_, tokens_ + bytes_per_second_ * std::max(0.0, passed.count()));
    }
    filled_ = now;
    return tokens_ < min_portion ? 0 : static_cast<std::size_t>(tokens_);
}

void TunnelGroup::count_received(std::uint64_t bytes) noexcept
{
    received_ += bytes;
    tokens_ -= static_cast<double>(bytes);
}

void TunnelGroup::count_sent(std::uint64_t bytes) noexcept
{
    sent_ += bytes;
    tokens_ -= static_cast<double>(bytes);
}

} // namespace webots_cloud
