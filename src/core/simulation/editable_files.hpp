// The programs of one simulation that its page may read and change (protocol section 13.19).
#pragma once

#include "core/pace.hpp"

#include <webots_cloud/error.hpp>
#include <webots_cloud/time.hpp>

#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The largest file that is shown or saved, in bytes: in JSON, where each byte of a text takes two at most,
/// it fits into a message of 64 KiB, the most that servers and session servers before them take.
inline constexpr std::size_t largest_editable = 30'000;

/// How many files of a project are shown.
inline constexpr std::size_t most_editable = 100;

/// True for what is shown in an editor: well-formed UTF-8 without control characters, but for tabs and ends
/// of lines.
bool is_editable_text(std::string_view text) noexcept;

/// True for the name of a file below `controllers/` that may be shown and saved: names separated by `/`, two
/// at least, none of which leads out of the folder.
bool is_editable_name(std::string_view file);

/// The texts below `controllers/`, as they were fetched and as they are now. They are kept here, so nothing
/// that the simulation writes is ever read: neither a link that it plants, nor a pipe.
class EditableFiles
{
public:
    /// File names, relative to `controllers/`, and texts.
    using Texts = std::map<std::string, std::string, std::less<>>;

    /// Leaves out what is no editable text, and what is beyond `most_editable`. `world`: the text of the
    /// world file, whose robots' controllers come first in the list.
    EditableFiles(Texts originals, std::string_view world);

    bool empty() const noexcept { return texts_.empty(); }

    /// `files: [{"path":"drive/drive.py","changed":true}, ...]`
    std::string list_message() const;

    /// The text as it is now; `original`: as it was fetched, empty for a file that is new.
    ///
    /// Errors: `not_found`.
    result<std::string> read(std::string_view file, bool original) const;

    /// Whether this may be saved now; every call counts, so that a page can't keep the disk busy.
    ///
    /// Errors: `not_found`: it is not in a folder of the project; `too_large`; `invalid_argument`: it is no
    /// text; `refused`: saved too often.
    result<> may_save(std::string_view file, std::string_view text, TimePoint now);

    /// The folders with sources in C or C++ that a makefile finds: directly in them, and not in folders
    /// below.
    std::vector<std::string> compiled_controllers() const;

    /// The folder has a makefile of its own, as it is now.
    bool has_makefile(std::string_view controller) const;

    /// Whether this folder may be compiled now; every call counts, as of `may_save`.
    ///
    /// Errors: `not_found`: there are no such sources; `refused`: asked too often.
    result<> may_compile(std::string_view controller, TimePoint now);

    /// It has been written.
    void saved(std::string file, std::string text);

    /// It is as it was fetched.
    void restored(std::string_view file);

private:
    struct File
    {
        std::string original;
        std::string text;
        bool is_new = false;
    };

    bool has_folder_of(std::string_view file) const;

    bool is_used(std::string_view file) const;

    std::map<std::string, File, std::less<>> texts_;
    std::set<std::string, std::less<>> used_; ///< Controllers that the world names.
    Pace saves_;
};

/// What the page is told of one file: `file: {"path":"drive/drive.py","text":"..."}`, with `original` instead
/// of `text` for a text as it was fetched.
std::string file_message(std::string_view file, std::string_view text, bool original);

/// `compiles: ["drive","walk"]`: these can be compiled here.
std::string compiles_message(std::vector<std::string> const& controllers);

/// `compiled: {"controller":"drive","output":"..."}`, with `error`, `code` and `values` as below if it has
/// failed. `output`: what was printed, any bytes.
std::string compiled_message(std::string_view controller, std::string_view output, result<> const& outcome);

/// `file: {"path":"drive/drive.py","saved":true}`
std::string file_saved_message(std::string_view file);

/// `file: {"path":"drive/drive.py","error":"<sentence>","code":"<code of the refusal>","values":{...}}`
std::string file_error_message(std::string_view file, Failure const& failure);

} // namespace webots_cloud::core
