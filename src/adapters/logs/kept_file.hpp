// A small file that a server keeps over restarts, and can do without.
#pragma once

#include <webots_cloud/error.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

namespace webots_cloud::adapters {

/// Thread-safety: one executor.
class KeptFile
{
public:
    virtual ~KeptFile() = default;

    /// All bytes of it. Blocks, for as long as reading a small file takes: for the start of a server.
    /// Errors: `not_found`: there is no such file; `unavailable`: it is too large, or can't be read.
    virtual result<std::string> read() const = 0;

    /// Replaces it as a whole, on a thread of its own: readers find the old bytes or the new ones, even
    /// after a crash. Only its owner may read it. Its folder is made.
    ///
    /// Cancellation: none.
    /// Errors: `unavailable`; then the old bytes stay.
    virtual boost::asio::awaitable<result<>> replace(std::string bytes) = 0;
};

/// `limit`: bytes that are read at most.
std::unique_ptr<KeptFile> make_kept_file(std::filesystem::path path, std::size_t limit);

} // namespace webots_cloud::adapters
