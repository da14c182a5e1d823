#include "git_staging.hpp"

#include "adapters/files/project_files.hpp"
#include "core/refusals.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <limits>

namespace webots_cloud::adapters {
namespace {

constexpr std::uint64_t max_memory = std::uint64_t{256}
                                     << 20; // all folders of a commit: some 40 bytes per file
constexpr char part[] = "part";

} // namespace

result<> GitStaging::pay_for(GitObjectKind kind, std::uint64_t size)
{
    if (watch_ && kind == GitObjectKind::blob)
        if (auto const may_begin = watch_->begins(size); !may_begin)
            return may_begin;
    if (!share_)
        return {};
    FetchBytes price;
    price.memory = git_object_memory;
    if (kind == GitObjectKind::blob)
        price.disk = bytes_on_disk(size);
    else
        price.memory += size;
    return share_->take(price);
}

result<> GitStaging::take_memory(std::uint64_t bytes)
{
    FetchBytes price;
    price.memory = bytes;
    return share_ ? share_->take(price) : result<>();
}

void GitStaging::give_back_memory(std::uint64_t bytes) noexcept
{
    FetchBytes price;
    price.memory = bytes;
    if (share_)
        share_->give_back(price);
}

result<> GitStaging::put(GitObjectKind kind, core::GitObjectId const& id, std::string bytes)
{
    if (kind != GitObjectKind::blob) {
        memory_ += bytes.size();
        if (memory_ > max_memory)
            return core::refused(core::Refused::repository_folders);
        objects_.emplace(id, std::move(bytes));
        return {};
    }
    if (!blobs_.emplace(id, bytes.size()).second)
        return {};
    if (auto const written = write_file(folder_, to_hex(id).c_str(), bytes, 0644); !written)
        return written;
    return note_arrival(id, bytes.size());
}

result<> GitStaging::note_arrival(core::GitObjectId const& id, std::uint64_t size)
{
    return watch_ ? watch_->arrived(id, size) : result<>();
}

std::string const* GitStaging::find(core::GitObjectId const& id) const
{
    auto const found = objects_.find(id);
    return found == objects_.end() ? nullptr : &found->second;
}

result<std::string> GitStaging::read_blob(core::GitObjectId const& id) const
{
    auto bytes = read_file(folder_, to_hex(id).c_str(), std::numeric_limits<std::int64_t>::max());
    if (!bytes)
        return core::refused(core::Refused::not_read);
    return bytes;
}

result<> GitStaging::begin_blob()
{
    open_blob_ =
        FileDescriptor(::openat(folder_, part, O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0644));
    if (!open_blob_)
        return disk_failure();
    return {};
}

result<> GitStaging::append(std::string_view bytes)
{
    return write_all(open_blob_.get(), bytes);
}

result<> GitStaging::finish_blob(core::GitObjectId const& id, std::uint64_t size)
{
    open_blob_ = FileDescriptor();
    blobs_.emplace(id, size);
    if (::renameat(folder_, part, folder_, to_hex(id).c_str()) != 0)
        return disk_failure();
    return note_arrival(id, size);
}

} // namespace webots_cloud::adapters
