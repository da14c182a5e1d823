#include "copy_tree.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <boost/asio/error.hpp>

namespace webots_cloud::adapters {

namespace fs = std::filesystem;
using core::concat;

result<> copy_tree(fs::path const& from, fs::path const& to, FetchLimits const& limits,
                   FetchProgress& progress, std::atomic<bool> const& aborted)
{
    std::error_code failed;
    std::uint32_t files = 0;
    std::uint64_t bytes = 0;
    for (auto entry = fs::recursive_directory_iterator(from, failed); !failed && entry != fs::end(entry);
         entry.increment(failed)) {
        if (aborted.load(std::memory_order_relaxed))
            return Failure(boost::asio::error::operation_aborted);
        auto const type = entry->symlink_status(failed).type();
        auto const target = to / entry->path().lexically_relative(from);
        if (++files > limits.files)
            return core::refused(core::Refused::too_many_files, {{"max", std::to_string(limits.files)}});
        if (type == fs::file_type::directory) {
            fs::create_directory(target, failed);
        } else if (type == fs::file_type::regular) {
            bytes += entry->file_size(failed);
            if (bytes > limits.bytes)
                return core::refused(core::Refused::project_too_large,
                                     {{"max", std::to_string(limits.bytes >> 20)}});
            progress.bytes_received = bytes;
            if (!failed)
                fs::copy_file(entry->path(), target, failed);
        }
        if (failed)
            break;
    }
    if (failed)
        return core::refused(core::Refused::not_copied, {{"words", failed.message()}});
    return {};
}

} // namespace webots_cloud::adapters
