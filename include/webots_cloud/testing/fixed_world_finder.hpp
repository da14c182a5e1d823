// Worlds that the test says.
#pragma once

#include <webots_cloud/transport/world_finder.hpp>

#include <vector>

namespace webots_cloud::testing {

/// Finds what the test says.
class FixedWorldFinder final : public WorldFinder
{
public:
    boost::asio::awaitable<std::vector<FoundWorld>> find() override
    {
        ++looked;
        co_return worlds;
    }

    std::vector<FoundWorld> worlds;
    int looked = 0; ///< How often.
};

} // namespace webots_cloud::testing
