// A byte stream from a thread that receives to one that reads.
#pragma once

#include <webots_cloud/error.hpp>

#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// A bounded stream: a full one blocks the writer.   Thread-safety: one writer, one reader.
class GitPipe
{
public:
    /// Waits while there is no room.   Errors: `operation_aborted` once the reader has left.
    result<> write(std::string_view bytes);

    /// Nothing more comes; a failure is what the reader gets after the bytes.
    void end(result<> outcome);

    /// At least one byte, or 0 at the end. Waits for the writer.   Errors: what `end` was given.
    result<std::size_t> read(char* buffer, std::size_t size);

    /// The reader leaves.
    void leave();

private:
    std::mutex mutex_;
    std::condition_variable changed_;
    std::string bytes_;
    std::size_t used_ = 0; ///< So many at the start of `bytes_` were read.
    bool ended_ = false;
    bool left_ = false;
    result<> outcome_;
};

} // namespace webots_cloud::adapters
