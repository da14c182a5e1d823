// The worlds in plain folders of this machine, for the gallery of a session server: `GET /worlds`.
#pragma once

#include "core/pages/shared_page.hpp"
#include "core/projects/repository_policy.hpp"
#include "world_pictures.hpp"

#include <webots_cloud/transport/clock.hpp>
#include <webots_cloud/transport/endpoint.hpp>
#include <webots_cloud/transport/world_finder.hpp>

#include <boost/asio/awaitable.hpp>

#include <functional>
#include <string_view>
#include <vector>

namespace webots_cloud {

/// Looks for them now and then, and answers from memory. Only what the operator's rules accept is listed.
///
/// Lifetime: all that it is made with must outlive it; `finder` may be null.   Thread-safety: one executor.
class LocalWorlds
{
public:
    LocalWorlds(WorldFinder* finder, core::RepositoryPolicy const& policy, WorldPictures const& pictures,
                Clock& clock)
        : finder_(finder), policy_(policy), pictures_(pictures), clock_(clock)
    {}

    /// Cancellation: terminal.
    boost::asio::awaitable<result<>> run();

    HttpResponse answer(IncomingRequest const& request);

    /// Those in a folder, whether the rules accept them or not.   `parse`: of their addresses.
    std::vector<ListedWorld>
    worlds_in(ProjectRef const& folder,
              std::function<result<ProjectRef>(std::string_view url)> const& parse) const;

    /// The rules have changed.
    void refresh() noexcept { page_.expire(); }

private:
    std::string listed() const;

    WorldFinder* finder_;
    core::RepositoryPolicy const& policy_;
    WorldPictures const& pictures_;
    Clock& clock_;
    std::vector<FoundWorld> found_;
    core::TimedPage page_;
};

} // namespace webots_cloud
