// Small files of folders on this computer, as a seam.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>

#include <boost/asio/awaitable.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace WEBOTS_CLOUD_API webots_cloud {

/// A file to write.
struct TextFile
{
    TextFile() = default;
    TextFile(std::string name, std::string text) : name(std::move(name)), text(std::move(text)) {}

    std::string name; ///< Relative to the folder: names separated by `/`.
    std::string text; ///< Any bytes.
};

/// The text of each file that was asked for, in their order, or nothing where there is no such file.
using TextsRead = std::vector<std::optional<std::string>>;

/// Which files are worth reading.
struct TextLimits
{
    TextLimits() = default;

    std::size_t bytes = 0; ///< Larger files are left out.
    std::size_t files = 0; ///< What comes after these is left out.
    std::size_t depth = 8; ///< Folders within folders.
};

/// Reads and writes whole files. Never works on the caller's thread, and never follows symbolic links below
/// the folder, so that a project can't make it access other files.
///
/// Thread-safety: one executor.
class TextFiles
{
public:
    virtual ~TextFiles() = default;

    /// The texts of regular files; nothing for what is missing or no regular file.
    ///
    /// Cancellation: none.
    /// Errors: `too_large` (64 MiB), `unavailable`; the detail is a sentence for the person who asked.
    virtual boost::asio::awaitable<result<TextsRead>> read(std::filesystem::path folder,
                                                           std::vector<std::string> names) = 0;

    /// The regular files in the folder and the folders in it, in the order of their names, named relative to
    /// it; none where there is no such folder. Not meant for folders of more than a few thousand files.
    ///
    /// Cancellation: none.
    /// Errors: `unavailable`, as above.
    virtual boost::asio::awaitable<result<std::vector<TextFile>>> read_all(std::filesystem::path folder,
                                                                           TextLimits limits) = 0;

    /// Writes files over what is there, for the owner of their folder; a link is replaced, not followed, and
    /// what may be run stays so. The folders of their names exist.
    ///
    /// Cancellation: none.
    /// Errors: `unavailable`, as above.
    virtual boost::asio::awaitable<result<>> write(std::filesystem::path folder,
                                                   std::vector<TextFile> files) = 0;
};

} // namespace webots_cloud
