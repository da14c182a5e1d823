// What `/metrics` of the session server says of each of its machines.
#pragma once

#include "site_context.hpp"

#include <boost/asio/awaitable.hpp>

#include <cstdint>
#include <optional>
#include <string>

namespace webots_cloud {

/// With thousands of machines the text is a megabyte, and takes so long to write that others would notice. So
/// it is written once a second, whether somebody asks or not, a few machines at once. With fewer machines it
/// is written for whoever asks, once a second at most.
///
/// Lifetime: the site must outlive it.   Thread-safety: one executor.
class MachineMetrics
{
public:
    explicit MachineMetrics(SiteContext const& site) : site_(site) {}

    /// As it was some seconds ago at most; the families of `/metrics`, one after the other.
    std::string const& text();

    /// Something has changed that is to be seen at once.
    void expire() noexcept;

    /// Writes ahead of time.
    /// Cancellation: terminal.
    boost::asio::awaitable<result<>> run();

private:
    class Families;

    bool is_large() const noexcept;
    void add(ServerLoad const& server, Families& families) const;

    SiteContext const& site_;
    std::string text_;
    std::optional<TimePoint> made_; ///< When `text_` was; nothing: it is not what it should be.
    std::uint64_t expiries_ = 0;    ///< Of what is being written, too.
};

} // namespace webots_cloud
