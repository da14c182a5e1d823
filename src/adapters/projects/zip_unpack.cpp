// libarchive reads the format; the names, sizes and numbers in an archive are a stranger's, and are checked
// here before anything is written. Folders are opened one by one, so that no name leads out of the project.
#include "zip_unpack.hpp"

#include "adapters/files/folder_walk.hpp"
#include "adapters/files/project_files.hpp"

#include "core/projects/archive_path.hpp"
#include "core/projects/zip_directory.hpp"
#include "core/refusals.hpp"
#include "core/safe_names.hpp"
#include "core/text.hpp"

#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <clocale>
#include <memory>
#include <string>
#include <unordered_set>

namespace webots_cloud::adapters {
namespace {

using core::concat;
using core::Refused;

constexpr std::size_t block = 64 * 1024;

/// libarchive converts names to the thread's locale, and gives up on those that don't exist there.
class Utf8Locale
{
public:
    Utf8Locale()
        : locale_(::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr)),
          before_(locale_ ? ::uselocale(locale_) : nullptr)
    {}
    Utf8Locale(Utf8Locale const&) = delete;
    ~Utf8Locale()
    {
        if (!locale_)
            return;
        ::uselocale(before_);
        ::freelocale(locale_);
    }

private:
    locale_t locale_;
    locale_t before_;
};

struct FreeArchive
{
    void operator()(archive* reader) const noexcept { archive_read_free(reader); }
};

Failure bad_zip(archive* reader)
{
    auto const* const words = archive_error_string(reader);
    return core::refused(Refused::bad_zip,
                         {{"words", core::printable(words ? words : "it can't be read", 200)}});
}

Failure refuse(Refused entry, std::string_view path)
{
    return core::refused(entry, {{"path", core::printable(path, 100)}});
}

result<std::string> read_tail(int file, std::uint64_t size)
{
    std::string tail(std::min<std::uint64_t>(size, core::zip_tail), '\0');
    std::size_t have = 0;
    while (have < tail.size()) {
        auto const at = static_cast<off_t>(size - tail.size() + have);
        auto const count = ::pread(file, tail.data() + have, tail.size() - have, at);
        if (count <= 0)
            return disk_failure();
        have += static_cast<std::size_t>(count);
    }
    return tail;
}

/// Writes the entries of an archive below one folder, one after the other, and stops at the first that must
/// not be.
class Unpacker
{
public:
    Unpacker(archive* reader, int root, UnpackLimits const& limits, std::uint64_t archive_bytes,
             FetchInterrupt const& interrupt)
        : reader_(reader), walk_(root), limits_(limits),
          max_bytes_(std::min(limits.bytes, std::max(limits.free_growth, limits.growth * archive_bytes))),
          interrupt_(interrupt)
    {}

    result<std::vector<std::string>> run()
    {
        for (;;) {
            archive_entry* entry = nullptr;
            auto const outcome = archive_read_next_header(reader_, &entry);
            if (outcome == ARCHIVE_EOF)
                return std::move(forbidden_);
            if (outcome != ARCHIVE_OK)
                return bad_zip(reader_);
            if (auto const may_go_on = ask(interrupt_); !may_go_on)
                return may_go_on.error();
            if (auto const added = add(entry); !added)
                return added.error();
        }
    }

private:
    result<> add(archive_entry* entry)
    {
        auto const* const name = archive_entry_pathname(entry);
        auto const place = core::archive_path(name ? name : "");
        if (!place)
            return place.error();
        if (place->is_forbidden) {
            core::tell_forbidden(forbidden_, place->path);
            return count(place->path);
        }
        auto const& path = place->path;
        if (auto const judged = judge(entry, path); !judged)
            return judged;
        if (auto const made = make_folders_of(path); !made)
            return made;
        auto const folder = walk_.parent_of(path);
        if (!folder)
            return folder.error();
        bool const is_folder = archive_entry_filetype(entry) == AE_IFDIR;
        if (auto const counted = count(path); !counted)
            return counted;
        if (!is_folder && !seen_.insert(path).second)
            return refuse(Refused::zip_with_file_twice, path);
        return is_folder ? make(*folder, file_name(path), path) : write(*folder, file_name(path), path);
    }

    result<> judge(archive_entry* entry, std::string const& path) const
    {
        auto const type = archive_entry_filetype(entry);
        if (archive_entry_symlink(entry) || archive_entry_hardlink(entry) || type == AE_IFLNK)
            return refuse(Refused::zip_with_link, path);
        if (type != AE_IFREG && type != AE_IFDIR)
            return refuse(Refused::zip_with_device, path);
        if (archive_entry_is_encrypted(entry))
            return refuse(Refused::zip_encrypted, path);
        // Others need memory that the archive, and not we, would choose.
        auto const method = std::string_view(archive_format_name(reader_));
        if (!method.ends_with("(deflation)") && !method.ends_with("(uncompressed)"))
            return refuse(Refused::zip_compression, path);
        if (archive_entry_size_is_set(entry) &&
            bytes_ + static_cast<std::uint64_t>(archive_entry_size(entry)) > max_bytes_)
            return too_large();
        return {};
    }

    /// One more file or folder, with what it takes however small it is.
    result<> count(std::string_view path)
    {
        constexpr std::uint64_t remembered = 128; // bytes, besides its path
        if (++entries_ > limits_.entries)
            return core::refused(Refused::too_many_files, {{"max", std::to_string(limits_.entries)}});
        FetchBytes price;
        price.memory = remembered + path.size();
        price.disk = bytes_on_disk(0);
        return limits_.share ? limits_.share->take(price) : result<>();
    }

    Failure too_large() const
    {
        if (max_bytes_ < limits_.bytes)
            return core::refused(Refused::archive_bomb, {{"max", std::to_string(max_bytes_ >> 20)}});
        return core::refused(Refused::project_too_large, {{"max", std::to_string(limits_.bytes >> 20)}});
    }

    /// Archives need not name the folders of their files.
    result<> make_folders_of(std::string const& path)
    {
        for (auto slash = path.find('/'); slash != std::string::npos; slash = path.find('/', slash + 1)) {
            auto const folder = path.substr(0, slash);
            if (folders_.count(folder) > 0)
                continue;
            if (auto const counted = count(folder); !counted)
                return counted;
            folders_.insert(folder);
            auto const parent = walk_.parent_of(folder);
            if (!parent)
                return parent.error();
            if (auto const made = make(*parent, file_name(folder), folder); !made)
                return made;
        }
        return {};
    }

    static result<> make(int parent, char const* name, std::string const& path)
    {
        struct stat status;
        if (::mkdirat(parent, name, 0755) == 0)
            return {};
        if (errno != EEXIST)
            return disk_failure();
        if (::fstatat(parent, name, &status, AT_SYMLINK_NOFOLLOW) != 0 || !S_ISDIR(status.st_mode))
            return refuse(Refused::zip_with_file_as_folder, path);
        return {};
    }

    result<> write(int parent, char const* name, std::string const& path)
    {
        if (::unlinkat(parent, name, 0) != 0 && errno != ENOENT)
            return errno == EISDIR ? result<>(refuse(Refused::zip_with_file_as_folder, path))
                                   : disk_failure();
        FileDescriptor const file(
            ::openat(parent, name, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
        if (!file)
            return disk_failure();
        for (;;) {
            auto const count = archive_read_data(reader_, buffer_.data(), buffer_.size());
            if (count == 0)
                return {};
            if (count < 0)
                return bad_zip(reader_);
            bytes_ += static_cast<std::uint64_t>(count);
            if (bytes_ > max_bytes_)
                return too_large();
            if (auto const may_go_on = ask(interrupt_); !may_go_on)
                return may_go_on;
            if (auto const paid = pay(static_cast<std::uint64_t>(count)); !paid)
                return paid;
            auto const text = std::string_view(buffer_.data(), static_cast<std::size_t>(count));
            if (auto const written = write_all(file.get(), text); !written)
                return written;
        }
    }

    result<> pay(std::uint64_t bytes)
    {
        FetchBytes price;
        price.disk = bytes;
        return limits_.share ? limits_.share->take(price) : result<>();
    }

    archive* reader_;
    FolderWalk walk_;
    UnpackLimits limits_;
    std::uint64_t max_bytes_;
    FetchInterrupt const& interrupt_;
    std::uint32_t entries_ = 0;
    std::uint64_t bytes_ = 0;
    std::unordered_set<std::string> seen_;    ///< Files.
    std::unordered_set<std::string> folders_; ///< That are there for certain.
    std::vector<std::string> forbidden_;      ///< What is left out, as it may be shown.
    std::array<char, block> buffer_;
};

} // namespace

result<std::vector<std::string>> unpack_zip(int file, int root, UnpackLimits const& limits,
                                            FetchInterrupt const& interrupt)
{
    auto const end = ::lseek(file, 0, SEEK_END);
    if (end < 0 || ::lseek(file, 0, SEEK_SET) != 0)
        return disk_failure();
    auto const size = static_cast<std::uint64_t>(end);
    auto const tail = read_tail(file, size);
    if (!tail)
        return tail.error();
    if (auto const checked = core::check_zip_directory(*tail, size, limits.entries); !checked)
        return checked.error();

    // A reader takes the list of all entries into memory, and several times as much as the list is long.
    constexpr std::uint64_t growth = 8;
    constexpr std::uint64_t max_list_memory = std::uint64_t{24} << 20;
    FetchBytes list;
    list.memory = std::min(growth * size, max_list_memory);
    if (limits.share)
        if (auto const taken = limits.share->take(list); !taken)
            return taken.error();

    Utf8Locale const locale;
    std::unique_ptr<archive, FreeArchive> const reader(archive_read_new());
    archive_read_support_format_zip_seekable(reader.get());
    if (archive_read_open_fd(reader.get(), file, block) != ARCHIVE_OK)
        return bad_zip(reader.get());
    auto const unpacker = std::make_unique<Unpacker>(reader.get(), root, limits, size, interrupt);
    return unpacker->run();
}

result<> make_runnable(std::filesystem::path const& root, mode_t mode)
{
    namespace fs = std::filesystem;
    std::error_code failed;
    for (auto entry = fs::recursive_directory_iterator(root, failed); !failed && entry != fs::end(entry);) {
        if (core::is_runnable_name(entry->path().filename().string()))
            fs::permissions(entry->path(), fs::perms(mode), failed);
        if (!failed)
            entry.increment(failed);
    }
    if (failed)
        return disk_failure(failed);
    return {};
}

} // namespace webots_cloud::adapters
