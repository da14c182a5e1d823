// Files that exist only in a test.
#pragma once

#include <webots_cloud/testing/fuse.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <map>
#include <string>
#include <vector>

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

    boost::asio::awaitable<result<std::vector<TextFile>>> read_all(std::filesystem::path folder,
                                                                   TextLimits limits) override
    {
        if (auto failure = fuse.strike())
            co_return std::move(*failure);
        std::vector<TextFile> found;
        auto const prefix = folder.string() + "/";
        for (auto const& [path, text] : texts)
            if (path.starts_with(prefix) && text.size() <= limits.bytes && found.size() < limits.files)
                found.emplace_back(path.substr(prefix.size()), text);
        co_return found;
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
