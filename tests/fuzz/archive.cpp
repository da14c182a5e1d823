// Zip files: whatever is in them, files and folders below the root are all that comes out, within the limits.
#include "fuzz.hpp"

#include "adapters/files/project_files.hpp"
#include "adapters/files/remove_tree.hpp"
#include "adapters/projects/zip_unpack.hpp"
#include "core/projects/archive_path.hpp"
#include "core/safe_names.hpp"

#include <fcntl.h>
#include <sys/mman.h>

#include <filesystem>

using namespace webots_cloud;
using namespace webots_cloud::adapters;
namespace fs = std::filesystem;

namespace {

UnpackLimits limits()
{
    UnpackLimits limits;
    limits.entries = 20;
    limits.bytes = 1 << 20;
    limits.free_growth = 64 << 10;
    return limits;
}

/// A folder with the folder that is unpacked into, and a neighbour that must not change.
struct Scratch
{
    Scratch()
    {
        auto name = (fs::temp_directory_path() / "webots_cloud_archive_XXXXXX").string();
        fuzz::require(::mkdtemp(name.data()) != nullptr);
        path = name;
        fs::create_directory(path / "root");
    }
    ~Scratch() { (void)remove_tree(path); }

    fs::path path;
};

void check(fs::path const& root)
{
    std::uint64_t bytes = 0;
    for (auto const& entry : fs::recursive_directory_iterator(root)) {
        auto const type = entry.symlink_status().type();
        fuzz::require(type == fs::file_type::directory || type == fs::file_type::regular);
        if (type == fs::file_type::regular)
            bytes += entry.file_size();
    }
    fuzz::require(bytes <= limits().bytes);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    if (auto const path = core::archive_path(text))
        fuzz::require(path->is_forbidden || fuzz::stays_inside(path->path));

    static Scratch const scratch;
    FileDescriptor const archive(::memfd_create("archive", MFD_CLOEXEC));
    fuzz::require(write_all(archive.get(), text).has_value());
    auto const root = open_folder(AT_FDCWD, (scratch.path / "root").c_str());
    auto const unpacked = unpack_zip(archive.get(), root->get(), limits());
    fuzz::require(unpacked || !unpacked.error().message().empty());
    fuzz::require(!unpacked || unpacked->size() <= core::max_forbidden);
    fuzz::require(std::distance(fs::directory_iterator(scratch.path), fs::directory_iterator()) == 1);
    if (fs::is_empty(scratch.path / "root"))
        return 0;
    check(scratch.path / "root");
    fs::remove_all(scratch.path / "root");
    fs::create_directory(scratch.path / "root");
    return 0;
}
