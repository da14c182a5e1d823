// Folders that take what the test says.
#pragma once

#include <webots_cloud/transport/folder_meter.hpp>

#include <vector>

namespace webots_cloud::testing {

/// Folders that take as much as the test says.
class FixedFolderMeter final : public FolderMeter
{
public:
    boost::asio::awaitable<FolderUse> measure(std::filesystem::path folder, std::uint64_t) override
    {
        measured.push_back(std::move(folder));
        co_return use;
    }

    FolderUse use;                               ///< Of each folder.
    std::vector<std::filesystem::path> measured; ///< In order.
};

} // namespace webots_cloud::testing
