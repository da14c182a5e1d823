// Small text files of a project, read and written beside a simulation that may put links and pipes
// anywhere: folders are opened step by step, and no link is followed.
#include "adapters/files/project_files.hpp"
#include "adapters/files/restore_file.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <memory>

namespace webots_cloud {
namespace {

namespace fs = std::filesystem;
using adapters::FileDescriptor;

constexpr std::uint64_t max_file_size = std::uint64_t{64} << 20; // of one that is read

/// The folder of a file below `root`, and the file's own name.
struct Place
{
    FileDescriptor folder;
    std::string name;
};

result<Place> find_place(fs::path const& root, std::string const& file)
{
    auto const parts = core::split(file, '/');
    auto folder = adapters::open_folder(AT_FDCWD, root.c_str());
    for (std::size_t i = 0; folder && i + 1 < parts.size(); ++i)
        folder = adapters::open_folder(folder->get(), std::string(parts[i]).c_str());
    if (!folder)
        return folder.error();
    return Place{std::move(*folder), std::string(parts.back())};
}

result<std::optional<std::string>> read_text(fs::path const& root, std::string const& file)
{
    auto const place = find_place(root, file);
    struct stat status;
    if (!place || ::fstatat(place->folder.get(), place->name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0 ||
        !S_ISREG(status.st_mode))
        return std::optional<std::string>();
    if (static_cast<std::uint64_t>(status.st_size) > max_file_size)
        return core::refused(core::Refused::file_too_large, {{"file", file}});
    auto text = adapters::read_file(place->folder.get(), place->name.c_str(), max_file_size);
    if (!text)
        return text.error();
    return std::optional<std::string>(std::move(*text));
}

/// For `S_IXUSR` and the like of what stands at the place; 0: nothing, or no regular file.
mode_t mode_at(Place const& place)
{
    struct stat status;
    bool const is_file =
        ::fstatat(place.folder.get(), place.name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0 &&
        S_ISREG(status.st_mode);
    return is_file ? status.st_mode : 0;
}

/// What was there may be a link, or read by somebody.
result<> write_text(fs::path const& root, TextFile const& file)
{
    auto const place = find_place(root, file.name);
    if (!place)
        return place.error();
    return adapters::replace_file(place->folder.get(), place->name, 0644 | (mode_at(*place) & 0111),
                                  [&file](int to) { return adapters::write_all(to, file.text); });
}

struct CloseFolder
{
    void operator()(DIR* folder) const noexcept { ::closedir(folder); }
};

/// The names in an open folder, in their order; hidden ones are nobody's programs.
std::vector<std::string> names_in(int folder)
{
    std::vector<std::string> names;
    int const copy =
        ::openat(folder, ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC); // which reads from its beginning
    std::unique_ptr<DIR, CloseFolder> const opened(copy < 0 ? nullptr : ::fdopendir(copy));
    if (!opened && copy >= 0)
        ::close(copy);
    while (auto const* entry = opened ? ::readdir(opened.get()) : nullptr)
        if (entry->d_name[0] != '.')
            names.emplace_back(entry->d_name);
    std::sort(names.begin(), names.end());
    return names;
}

/// All files of a folder and those in it.
class ReadAll
{
public:
    ReadAll(fs::path folder, TextLimits limits) : folder_(std::move(folder)), limits_(limits) {}

    result<std::vector<TextFile>> operator()()
    {
        auto const root = adapters::open_folder(AT_FDCWD, folder_.c_str());
        if (root)
            read(root->get(), "", 0);
        return std::move(found_);
    }

private:
    void read(int folder, std::string const& prefix, std::size_t depth)
    {
        for (auto const& name : names_in(folder)) {
            struct stat status;
            if (found_.size() == limits_.files)
                return;
            if (::fstatat(folder, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) != 0)
                continue;
            if (S_ISDIR(status.st_mode) && depth < limits_.depth) {
                if (auto const inner = adapters::open_folder(folder, name.c_str()))
                    read(inner->get(), prefix + name + "/", depth + 1);
            } else if (S_ISREG(status.st_mode) &&
                       static_cast<std::uint64_t>(status.st_size) <= limits_.bytes) {
                if (auto text = adapters::read_file(folder, name.c_str(), limits_.bytes))
                    found_.emplace_back(prefix + name, std::move(*text));
            }
        }
    }

    fs::path folder_;
    TextLimits limits_;
    std::vector<TextFile> found_;
};

struct Read
{
    result<TextsRead> operator()() const
    {
        TextsRead texts;
        for (auto const& name : names) {
            auto text = read_text(folder, name);
            if (!text)
                return text.error();
            texts.push_back(std::move(*text));
        }
        return texts;
    }

    fs::path folder;
    std::vector<std::string> names;
};

struct Write
{
    result<> operator()() const
    {
        for (auto const& file : files)
            if (auto const written = write_text(folder, file); !written)
                return written;
        return {};
    }

    fs::path folder;
    std::vector<TextFile> files;
};

/// On a thread that may wait for the disk.
class LocalTextFiles final : public TextFiles
{
public:
    boost::asio::awaitable<result<TextsRead>> read(fs::path folder, std::vector<std::string> names) override
    {
        Read work{std::move(folder), std::move(names)};
        return pool_.run(std::move(work));
    }

    boost::asio::awaitable<result<std::vector<TextFile>>> read_all(fs::path folder,
                                                                   TextLimits limits) override
    {
        ReadAll work(std::move(folder), limits);
        return pool_.run(std::move(work));
    }

    boost::asio::awaitable<result<>> write(fs::path folder, std::vector<TextFile> files) override
    {
        Write work{std::move(folder), std::move(files)};
        return pool_.run(std::move(work));
    }

private:
    adapters::BlockingPool pool_{1};
};

} // namespace

std::unique_ptr<TextFiles> make_text_files()
{
    return std::make_unique<LocalTextFiles>();
}

} // namespace webots_cloud
