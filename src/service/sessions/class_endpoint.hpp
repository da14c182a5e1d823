// The WebSocket /class of a session server (protocol section 13.15).
#pragma once

#include "class_stager.hpp"
#include "core/classes/class_book.hpp"
#include "core/pages/metrics_text.hpp"
#include "site_context.hpp"

#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace webots_cloud {

/// Passes what browsers say to a ClassBook, and does what it says: sends, closes, holds seats.
///
/// Logs no names, codes, keys or tokens.
/// Lifetime: everything passed by reference must outlive it.   Thread-safety: one executor.
class ClassEndpoint
{
public:
    ClassEndpoint(SiteContext const& site, ClassStager& stager);

    /// The site's parameters are others. Without `teacherPassword` no class can be opened; those that exist
    /// go on.
    void apply();

    boost::asio::awaitable<void> serve(ChannelInfo info, Channel& channel);

    /// To be called about once a second.
    void update();

    /// The server is being stopped: all classes end.
    void stop();

    /// As in ClassBook.
    core::SeatRequest ask_for_seat(std::string_view token, TimePoint now);
    std::string class_of(std::string_view token) const { return book_.class_of(token); }
    /// The student was sent to the machine of this entry, by a browser that has asked us so.
    void take_seat(std::string_view token, core::SeatRequest seat, std::string_view entry,
                   AskedAddress const& asked, TimePoint now);

    void write_metrics(core::MetricsText& text) const;

private:
    struct Conversation
    {
        Channel* channel = nullptr;
        AskedAddress asked;
    };

    core::ClassHooks book_hooks();
    core::ClassNetwork network_of(AskedAddress const& asked) const;
    std::vector<std::string> machines_for(core::ClassConnection teacher) const;
    void warn_of_guesses(std::string_view what, std::string_view quota_key) const;
    void carry_out();
    void send(Conversation const& to, core::ClassOutput output);

    SiteContext const& site_;
    ClassStager& stager_;
    core::ClassBook book_;
    core::ClassConnection last_ = 0;
    std::unordered_map<core::ClassConnection, Conversation> conversations_;
    std::uint64_t relayed_ = 0; ///< Pictures.
    std::uint64_t dropped_ = 0; ///< Since a teacher's browser did not keep up.
};

} // namespace webots_cloud
