// A connection to another server, kept for the next request of the same browser.
#pragma once

#include "tunnel_end.hpp"

#include <webots_cloud/time.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <cstddef>
#include <utility>

namespace webots_cloud::adapters {

/// Nobody else's requests go that way, so what the other server may have left in it is harmless. Only of
/// servers that speak TLS: a handshake costs more than all that most files do.
class KeptUpstream
{
public:
    /// `open` counts those that there are, and must outlive it.
    KeptUpstream(Upstream upstream, NetworkStream::Released connection, TimePoint until, std::size_t& open)
        : upstream_(std::move(upstream)), end_(std::move(connection)), until_(until), open_(open)
    {
        ++open_;
    }
    KeptUpstream(KeptUpstream const&) = delete;
    KeptUpstream& operator=(KeptUpstream const&) = delete;
    ~KeptUpstream() { --open_; }

    bool is_overdue(TimePoint now) const noexcept { return now >= until_; }

    /// It leads there, and the other server has neither closed it nor said what nobody has asked for.
    bool is_good_for(Upstream const& upstream) noexcept
    {
        char byte = 0;
        std::size_t size = 0;
        return upstream.tls && upstream.host == upstream_.host && upstream.port == upstream_.port &&
               upstream.name == upstream_.name && upstream.elsewhere == upstream_.elsewhere &&
               end_.read(&byte, 1, false, size) == TunnelEnd::Reading::nothing;
    }

    NetworkStream::Released release() noexcept { return end_.release(); }

private:
    Upstream upstream_;
    TunnelEnd end_;
    TimePoint until_;
    std::size_t& open_;
};

} // namespace webots_cloud::adapters
