#include "adapters/files/project_files.hpp"
#include "adapters/threads/blocking_pool.hpp"
#include "core/refusals.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/files.hpp>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>

namespace webots_cloud {
namespace {

namespace fs = std::filesystem;
using adapters::FileDescriptor;

constexpr std::uint64_t max_file_size = std::uint64_t{64} << 20;

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

/// Beside it first, then over it in one step: what was there may be a link, or read by somebody.
result<> write_text(fs::path const& root, TextFile const& file)
{
    auto const place = find_place(root, file.name);
    if (!place)
        return place.error();
    constexpr auto beside = ".webots_cloud-new";
    int const folder = place->folder.get();
    ::unlinkat(folder, beside, 0);
    auto written = adapters::write_file(folder, beside, file.text, 0644);
    if (written && ::renameat(folder, beside, folder, place->name.c_str()) != 0)
        written = adapters::disk_failure();
    if (!written)
        ::unlinkat(folder, beside, 0);
    return written;
}

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

class LocalTextFiles final : public TextFiles
{
public:
    boost::asio::awaitable<result<TextsRead>> read(fs::path folder, std::vector<std::string> names) override
    {
        Read work{std::move(folder), std::move(names)};
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
