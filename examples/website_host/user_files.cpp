// Names come from strangers, and folders may hold anything: every step is taken from an open folder, and
// only ordinary files count.
#include "user_files.hpp"

#include <webots_cloud/adapters.hpp>

#include <archive.h>
#include <archive_entry.h>
#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <memory>
#include <optional>
#include <vector>

namespace website_host {

using webots_cloud::errc;
using webots_cloud::Failure;
using webots_cloud::result;

namespace {

constexpr int max_depth = 10;

/// A file descriptor that closes itself.
class Descriptor
{
public:
    explicit Descriptor(int number = -1) noexcept : number_(number) {}
    Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept
    {
        std::swap(number_, other.number_);
        return *this;
    }
    ~Descriptor()
    {
        if (number_ >= 0)
            ::close(number_);
    }

    int get() const noexcept { return number_; }
    int release() noexcept { return std::exchange(number_, -1); }
    explicit operator bool() const noexcept { return number_ >= 0; }

private:
    int number_;
};

Failure disk_failure(std::string_view what)
{
    return Failure(errc::unavailable, std::string(what) + ": " + std::strerror(errno));
}

/// A folder in another one, and no link to one.
Descriptor open_folder(int parent, std::string const& name)
{
    return Descriptor(::openat(parent, name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

/// The same, made if need be.
Descriptor make_folder(int parent, std::string const& name)
{
    if (::mkdirat(parent, name.c_str(), 0755) != 0 && errno != EEXIST)
        return Descriptor();
    return open_folder(parent, name);
}

std::vector<std::string> split(std::string_view path)
{
    std::vector<std::string> names;
    while (!path.empty()) {
        auto const name = path.substr(0, path.find('/'));
        names.emplace_back(name);
        path.remove_prefix(std::min(path.size(), name.size() + 1));
    }
    return names;
}

/// An ordinary file with one name: nothing that leads out of the folder.
struct StoredFile
{
    std::string path; ///< From the folder that was searched.
    std::uint64_t size = 0;
    std::time_t changed = 0;
};

/// The files of a folder and those below, sorted. Links and the like are left out. False: it has too many, or
/// can't be read.
bool list_files(Descriptor folder, std::string const& prefix, int depth, std::vector<StoredFile>& files)
{
    if (!folder || depth > max_depth)
        return false;
    std::vector<std::string> names;
    auto const close_folder = [](DIR* stream) { ::closedir(stream); };
    Descriptor copy(::fcntl(folder.get(), F_DUPFD_CLOEXEC, 0));
    std::unique_ptr<DIR, decltype(close_folder)> const stream(copy ? ::fdopendir(copy.get()) : nullptr,
                                                              close_folder);
    if (!stream)
        return false;
    copy.release();
    while (auto const* const entry = ::readdir(stream.get())) { // NOLINT(concurrency-mt-unsafe): ours alone
        std::string_view const name = entry->d_name;
        if (!is_plain_name(name))
            continue;
        names.emplace_back(name);
        if (names.size() + files.size() > max_files)
            return false;
    }
    std::sort(names.begin(), names.end());
    for (auto const& name : names) {
        Descriptor item(::openat(folder.get(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
        struct stat status
        {};
        if (!item || ::fstat(item.get(), &status) != 0)
            continue; // a link, or gone
        if (S_ISDIR(status.st_mode)) {
            if (!list_files(std::move(item), prefix + name + "/", depth + 1, files))
                return false;
        } else if (S_ISREG(status.st_mode) && status.st_nlink == 1) {
            StoredFile file;
            file.path = prefix + name;
            file.size = static_cast<std::uint64_t>(status.st_size);
            file.changed = status.st_mtime;
            files.push_back(std::move(file));
        }
    }
    return true;
}

std::optional<std::string> read_all(int root, StoredFile const& file)
{
    Descriptor folder(::fcntl(root, F_DUPFD_CLOEXEC, 0));
    auto names = split(file.path);
    auto const name = std::move(names.back());
    names.pop_back();
    for (auto const& each : names)
        folder = open_folder(folder.get(), each);
    Descriptor const content(
        ::openat(folder.get(), name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    struct stat status
    {};
    if (!content || ::fstat(content.get(), &status) != 0 || !S_ISREG(status.st_mode))
        return std::nullopt;
    std::string text(static_cast<std::size_t>(file.size), '\0');
    std::size_t size = 0;
    while (size < text.size()) {
        auto const got = ::read(content.get(), text.data() + size, text.size() - size);
        if (got <= 0)
            break;
        size += static_cast<std::size_t>(got);
    }
    text.resize(size);
    return text;
}

la_ssize_t append_bytes(archive*, void* text, void const* bytes, std::size_t size)
{
    static_cast<std::string*>(text)->append(static_cast<char const*>(bytes), size);
    return static_cast<la_ssize_t>(size);
}

struct FreeArchive
{
    void operator()(archive* writer) const noexcept { ::archive_write_free(writer); }
    void operator()(archive_entry* entry) const noexcept { ::archive_entry_free(entry); }
};

Failure zip_failure()
{
    return Failure(errc::unavailable, "The project can't be packed.");
}

result<> add_to_zip(archive& writer, StoredFile const& file, std::string const& content)
{
    std::unique_ptr<archive_entry, FreeArchive> const entry(::archive_entry_new());
    ::archive_entry_set_pathname(entry.get(), file.path.c_str());
    ::archive_entry_set_filetype(entry.get(), AE_IFREG);
    ::archive_entry_set_perm(entry.get(), 0644);
    ::archive_entry_set_size(entry.get(), static_cast<la_int64_t>(content.size()));
    ::archive_entry_set_mtime(entry.get(), file.changed, 0);
    if (::archive_write_header(&writer, entry.get()) != ARCHIVE_OK ||
        ::archive_write_data(&writer, content.data(), content.size()) !=
            static_cast<la_ssize_t>(content.size()))
        return zip_failure();
    return {};
}

} // namespace

bool is_plain_name(std::string_view name)
{
    constexpr std::string_view marks = "_-. ";
    auto const is_usable = [&](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               marks.find(c) != std::string_view::npos;
    };
    return !name.empty() && name.size() <= 100 && name.front() != '.' && name.front() != ' ' &&
           std::all_of(name.begin(), name.end(), is_usable);
}

result<> UserFiles::save(std::uint32_t user, std::string_view dirname, std::string const& filename,
                         std::string_view content) const
{
    std::error_code failed;
    std::filesystem::create_directories(folder_, failed);
    Descriptor const root(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (!root)
        return disk_failure("The folder of the users can't be opened");
    auto const own = make_folder(root.get(), std::to_string(user));
    auto folder = make_folder(own.get(), "projects");
    if (!folder)
        return disk_failure("The folder can't be made");
    std::vector<StoredFile> files;
    if (!list_files(open_folder(own.get(), "projects"), {}, 0, files))
        return Failure(errc::too_large, "You have more than " + std::to_string(max_files) + " files.");
    auto const path = std::string(dirname) + "/" + filename;
    std::uint64_t used = content.size();
    for (auto const& file : files)
        used += file.path == path ? 0 : file.size;
    if (used > disk_quota || files.size() >= max_files)
        return Failure(errc::too_large, "You would use " + std::to_string((used + 99'999) / 100'000 / 10) +
                                            "." + std::to_string((used + 99'999) / 100'000 % 10) + " MB in " +
                                            std::to_string(files.size() + 1) + " files; 10 MB in " +
                                            std::to_string(max_files) + " files are allowed.");
    for (auto const& name : split(dirname))
        folder = make_folder(folder.get(), name);
    if (!folder)
        return disk_failure("The folder can't be made");

    auto const temporary = ".saving-" + webots_cloud::make_token(); // no name that `is_plain_name` knows
    Descriptor const target(::openat(folder.get(), temporary.c_str(),
                                     O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0644));
    bool is_written = static_cast<bool>(target);
    while (is_written && !content.empty()) {
        auto const size = ::write(target.get(), content.data(), content.size());
        is_written = size > 0;
        content.remove_prefix(is_written ? static_cast<std::size_t>(size) : 0);
    }
    if (is_written && ::renameat(folder.get(), temporary.c_str(), folder.get(), filename.c_str()) == 0)
        return {};
    auto const why = disk_failure("The file can't be written");
    ::unlinkat(folder.get(), temporary.c_str(), 0);
    return why;
}

result<std::string> UserFiles::zip(std::uint32_t user, std::string const& project) const
{
    Descriptor folder(::open(folder_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    for (auto const& name : {std::to_string(user), std::string("projects"), project})
        folder = open_folder(folder.get(), name);
    if (!folder)
        return Failure(errc::not_found);
    std::vector<StoredFile> files;
    if (!list_files(Descriptor(::fcntl(folder.get(), F_DUPFD_CLOEXEC, 0)), {}, 0, files))
        return zip_failure();
    std::uint64_t size = 0;
    for (auto const& file : files)
        size += file.size;
    if (size > disk_quota)
        return zip_failure();

    std::string text;
    std::unique_ptr<archive, FreeArchive> const writer(::archive_write_new());
    if (::archive_write_set_format_zip(writer.get()) != ARCHIVE_OK ||
        ::archive_write_set_bytes_per_block(writer.get(), 0) != ARCHIVE_OK ||
        ::archive_write_open(writer.get(), &text, nullptr, append_bytes, nullptr) != ARCHIVE_OK)
        return zip_failure();
    for (auto const& file : files) {
        auto const content = read_all(folder.get(), file);
        if (!content)
            continue; // gone meanwhile
        if (auto const added = add_to_zip(*writer, file, *content); !added)
            return added.error();
    }
    if (::archive_write_close(writer.get()) != ARCHIVE_OK)
        return zip_failure();
    return text;
}

std::string UserFiles::name_of(std::uint32_t user, std::string const& project)
{
    return "user/" + std::to_string(user) + "/projects/" + project;
}

} // namespace website_host
