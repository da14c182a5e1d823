// The worlds that a site shows to visitors: those of the configuration, and those that machines have found.
#pragma once

#include "async/interruptible.hpp"
#include "core/pages/shared_page.hpp"
#include "site_context.hpp"

#include <webots_cloud/listed_world.hpp>
#include <webots_cloud/transport/http_client.hpp>

#include <boost/asio/awaitable.hpp>

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// Asks machines now and then for the worlds in their plain folders, and answers from memory. Machines of a
/// site have the same folders as a rule, so not all of a large site are asked. For an address that somebody
/// has pasted one of them is asked at once.
///
/// Lifetime: the site must outlive it.   Thread-safety: one executor.
class Gallery
{
public:
    explicit Gallery(SiteContext const& site) : site_(site) {}

    /// Cancellation: terminal.
    boost::asio::awaitable<result<>> run();

    /// The list, as JSON.
    HttpResponse answer(std::string_view if_none_match);

    /// The picture of a world of the list, by its key.
    HttpResponse picture(std::string_view key, std::string_view if_none_match) const;

    /// The worlds of a repository, or of a folder in one, by its address, as JSON like that of the list; or
    /// why there is no such list. A machine finds them, for this client, which is empty where it has no
    /// limits.
    ///
    /// Cancellation: none; it ends within half a minute, and when `stop` is called.
    boost::asio::awaitable<HttpResponse> look_into(std::string address, std::string client);

    /// The server stops.
    void stop() { looks_.interrupt(); }

    /// Whether the operator wants one.
    bool is_wanted() const noexcept
    {
        auto const& worlds = site_.config.service.worlds;
        return !worlds || !worlds->empty();
    }

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
    std::vector<ServerSpec> next_machines();
    boost::asio::awaitable<result<std::string>> find_worlds(std::string address, std::string client);
    std::vector<ListedWorld> worlds() const;

    SiteContext const& site_;
    async::Interruptible looks_;
    std::size_t last_asked_ = 0;                      ///< For such a list, of the machines that are up.
    std::map<std::string, Known, std::less<>> known_; ///< By the address of the machine.
    std::map<std::string, core::SharedPage, std::less<>> pictures_; ///< Of worlds of the list.
    core::TimedPage page_;
};

} // namespace webots_cloud
