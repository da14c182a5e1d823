// Files that exist only in a test.
#pragma once

#include <webots_cloud/testing/fuse.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <map>
#include <string>

namespace webots_cloud::testing {

/// Keeps texts by their whole path. Does no I/O.
class MemoryTextFiles final : public TextFiles
{
public:
    boost::asio::awaitable<result<TextsRead>> read(std::filesystem::path folder,
                                                   std::vector<std::string> names) override
    {
        if (auto failure = fuse.strike())
            co_return std::move(*failure);
        TextsRead read;
        for (auto const& name : names) {
            auto const found = texts.find((folder / name).string());
            read.push_back(found == texts.end() ? std::nullopt : std::optional(found->second));
        }
        co_return read;
    }

    boost::asio::awaitable<result<>> write(std::filesystem::path folder, std::vector<TextFile> files) override
    {
        if (auto failure = fuse.strike())
            co_return std::move(*failure);
        for (auto& file : files)
            texts[(folder / file.name).string()] = std::move(file.text);
        co_return result<>();
    }

    std::map<std::string, std::string> texts;
    Fuse fuse;
};

} // namespace webots_cloud::testing
