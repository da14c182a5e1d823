// The worlds that a site shows to visitors: those of the configuration, and those that machines have found.
#pragma once

#include "core/pages/shared_page.hpp"

#include <webots_cloud/config.hpp>
#include <webots_cloud/fleet.hpp>
#include <webots_cloud/listed_world.hpp>
#include <webots_cloud/load_monitor.hpp>
#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/http_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// Asks machines now and then for the worlds in their plain folders, and answers from memory. Machines of a
/// site have the same folders as a rule, so not all of a large site are asked.
///
/// Lifetime: all that it is made with must outlive it; `http` may be null.   Thread-safety: one executor.
class Gallery
{
public:
    Gallery(SessionServiceConfig const& config, Fleet const& fleet, LoadMonitor const& monitor,
            HttpClient* http, Clock& clock)
        : config_(config), fleet_(fleet), monitor_(monitor), http_(http), clock_(clock)
    {}

    /// Cancellation: terminal.
    boost::asio::awaitable<result<>> run();

    /// The list, as JSON.
    HttpResponse answer(std::string_view if_none_match);

    /// The picture of a world of the list, by its key.
    HttpResponse picture(std::string_view key, std::string_view if_none_match) const;

    /// Whether the operator wants one.
    bool is_wanted() const noexcept { return !config_.worlds || !config_.worlds->empty(); }

    /// The configuration has changed.
    void refresh() noexcept { page_.expire(); }

private:
    struct Known
    {
        TimePoint asked;
        std::vector<ListedWorld> worlds;
        std::vector<std::string> pictures; ///< Keys of those that it has.
    };

    std::string list_text();
    ServerSpec const* due() const;
    boost::asio::awaitable<result<>> ask(ServerSpec server);
    boost::asio::awaitable<result<>> fetch_pictures(ServerSpec server);
    void forget_removed();
    std::vector<ListedWorld> worlds() const;

    SessionServiceConfig const& config_;
    Fleet const& fleet_;
    LoadMonitor const& monitor_;
    HttpClient* http_;
    Clock& clock_;
    std::map<std::string, Known, std::less<>> known_;               ///< By the address of the machine.
    std::map<std::string, core::SharedPage, std::less<>> pictures_; ///< Of worlds of the list.
    core::TimedPage page_;
};

} // namespace webots_cloud
