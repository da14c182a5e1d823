// What people see of a site: the viewer, the gallery of its worlds, and the page of a class, with the scripts
// from which they and pages of other sites are made.
#pragma once

#include "core/pages/shared_page.hpp"
#include "core/refusals.hpp"
#include "gallery.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/transport/endpoint.hpp>

#include <boost/asio/awaitable.hpp>

#include <map>
#include <string_view>

namespace webots_cloud {

/// `/viewer`, `/view` and `/class`, but for WebSockets.
///
/// Lifetime: everything passed by reference must outlive it.   Thread-safety: one executor.
class SitePages
{
public:
    SitePages(SessionServiceConfig const& config, Gallery& gallery) : config_(config), gallery_(gallery) {}

    /// Where people find what they can start: the worlds of the site, or the page that starts any. Relative
    /// to
    /// `/`, for proxies that rewrite paths.
    std::string_view start() const noexcept { return gallery_.is_wanted() ? "viewer/worlds/" : "viewer/"; }

    Answer viewer(IncomingRequest const& request);

    /// For teachers and students.
    Answer class_page(IncomingRequest const& request);

    /// `/viewer/worlds/list`: the worlds at an address, which is the request's body.
    boost::asio::awaitable<HttpResponse> list_worlds(IncomingRequest const& request);

    /// The same where there is nothing to list.
    static HttpResponse no_worlds(core::Refused why);

private:
    HttpResponse defaults() const;
    HttpResponse embedded(std::string_view name, IncomingRequest const& request);

    SessionServiceConfig const& config_;
    Gallery& gallery_;
    std::map<char const*, core::SharedPage> files_; ///< By the address of their embedded contents.
};

} // namespace webots_cloud
