#include "copy_tree.hpp"

#include "core/refusals.hpp"
#include "core/text.hpp"

#include <boost/asio/error.hpp>

#include <functional>
#include <sys/stat.h>

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
        // Links, pipes and devices are not copied.
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

std::string tree_state(fs::path const& folder, std::uint32_t most_files, std::atomic<bool> const& aborted)
{
    std::error_code failed;
    std::uint32_t files = 0;
    std::uint64_t sum = 0; // the order in which a folder is read means nothing
    for (auto entry = fs::recursive_directory_iterator(folder, failed); !failed && entry != fs::end(entry);
         entry.increment(failed)) {
        struct stat status
        {};
        if (++files > most_files || aborted.load(std::memory_order_relaxed) ||
            ::lstat(entry->path().c_str(), &status) != 0)
            return {};
        auto const text = concat(entry->path().native(), "\n", std::to_string(status.st_mtim.tv_sec), ".",
                                 std::to_string(status.st_mtim.tv_nsec), "\n", std::to_string(status.st_size),
                                 "\n", std::to_string(status.st_ino));
        sum += std::hash<std::string>()(text);
    }
    return failed ? std::string() : concat("folder ", std::to_string(files), " ", std::to_string(sum));
}

} // namespace webots_cloud::adapters
