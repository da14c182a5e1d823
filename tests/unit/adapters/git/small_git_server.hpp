// A git server for unit tests: one repository with one commit, version 2 of the protocol; it sends everything
// at once.
#pragma once

#include "adapters/git_packs/git_digest.hpp"
#include "adapters/projects/small_web_server.hpp"
#include "core/git/git_object_id.hpp"
#include "core/git/git_pkt_line.hpp"

#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>

namespace webots_cloud {

/// Serves `owner/robots.git`: on the branch `main` what `folder` holds when the server
/// is made, its folders, files and symbolic links.
class SmallGitServer
{
public:
    explicit SmallGitServer(std::filesystem::path const& folder)
    {
        auto const author = std::string("T <t@localhost> 1700000000 +0000");
        commit_ = add(1, "commit",
                      "tree " + to_hex(add_folder(folder)) + "\nauthor " + author + "\ncommitter " + author +
                          "\n\nx\n");
        server_.emplace([this](auto const& request, auto& response) { answer(request, response); });
    }

    /// How many requests were answered.
    int asked() const { return server_->asked(); }

    std::string url() const { return server_->url(); }

private:
    /// Adds an object to the pack, not compressed.
    core::GitObjectId add(unsigned type, std::string const& name, std::string const& content)
    {
        adapters::GitDigest digest;
        digest.update(name + " " + std::to_string(content.size()) + '\0' + content);
        auto size = content.size() >> 4;
        auto byte = static_cast<unsigned>(type << 4 | (content.size() & 15));
        for (; size > 0; size >>= 7) {
            objects_ += static_cast<char>(byte | 0x80);
            byte = static_cast<unsigned>(size & 0x7F);
        }
        objects_ += static_cast<char>(byte);
        std::string stored(compressBound(content.size()) + 64, '\0');
        uLongf length = stored.size();
        compress2(reinterpret_cast<Bytef*>(stored.data()), &length,
                  reinterpret_cast<Bytef const*>(content.data()), content.size(), Z_NO_COMPRESSION);
        objects_ += stored.substr(0, length);
        ++count_;
        return digest.finish();
    }

    core::GitObjectId add_folder(std::filesystem::path const& folder)
    {
        std::map<std::string, std::string>
            entries; // in git's order: folders as if their names ended with a slash
        for (auto const& each : std::filesystem::directory_iterator(folder)) {
            auto const name = each.path().filename().string();
            if (each.is_symlink()) {
                entries[name] = entry("120000", name,
                                      add(3, "blob", std::filesystem::read_symlink(each.path()).string()));
            } else if (each.is_directory()) {
                entries[name + "/"] = entry("40000", name, add_folder(each.path()));
            } else if (each.is_regular_file()) {
                std::ostringstream text;
                text << std::ifstream(each.path()).rdbuf();
                entries[name] = entry("100644", name, add(3, "blob", text.str()));
            }
        }
        std::string tree;
        for (auto const& [key, text] : entries)
            tree += text;
        return add(2, "tree", tree);
    }

    static std::string entry(std::string const& mode, std::string const& name, core::GitObjectId const& id)
    {
        return mode + " " + name + '\0' + std::string(id.bytes.begin(), id.bytes.end());
    }

    std::string pack() const
    {
        std::string pack("PACK\0\0\0\2\0\0\0", 11);
        pack += static_cast<char>(count_);
        pack += objects_;
        adapters::GitDigest digest;
        digest.update(pack);
        auto const id = digest.finish();
        return pack.append(id.bytes.begin(), id.bytes.end());
    }

    void answer(SmallWebServer::Request const& request, SmallWebServer::Response& response) const
    {
        using core::pkt_line;
        if (request.target() != "/owner/robots.git/git-upload-pack")
            response.result(404);
        else if (request.body().find("command=ls-refs") != std::string::npos)
            response.body() = pkt_line(to_hex(commit_) + " refs/heads/main\n").append(core::pkt_flush);
        else
            response.body() = pkt_line("packfile\n").append(pkt_line("\1" + pack())).append(core::pkt_flush);
    }

    std::string objects_;
    unsigned count_ = 0; ///< Of objects; less than 256.
    core::GitObjectId commit_;
    std::optional<SmallWebServer> server_;
};

} // namespace webots_cloud
