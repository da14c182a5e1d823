// The worlds in plain folders of a machine, as a seam.
#pragma once

#include <webots_cloud/export.hpp>
#include <webots_cloud/listed_world.hpp>

#include <boost/asio/awaitable.hpp>

#include <string>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A world, and the address of the forge that it is on.
struct FoundWorld
{
    FoundWorld() = default;

    ListedWorld world;
    std::string forge; ///< Without a slash at the end, as in `ForgeConfig`.

    bool operator==(FoundWorld const&) const = default;
};

/// Looks for worlds.
class WorldFinder
{
public:
    virtual ~WorldFinder() = default;

    /// All of them, in the order of their addresses; of very many some. What can't be read is left out.
    ///
    /// Cancellation: none; it ends after a bounded number of files.
    virtual boost::asio::awaitable<std::vector<FoundWorld>> find() = 0;
};

} // namespace webots_cloud
