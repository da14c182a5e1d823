#include "kept_file.hpp"

#include "adapters/files/file_descriptor.hpp"
#include "adapters/files/project_files.hpp"
#include "adapters/threads/blocking_pool.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <utility>

namespace webots_cloud::adapters {
namespace {

namespace fs = std::filesystem;

result<> replace_file(fs::path const& path, std::string const& bytes)
{
    std::error_code failed;
    fs::create_directories(path.parent_path(), failed);
    fs::path fresh = path;
    fresh += ".new";
    ::unlink(fresh.c_str()); // what a crash has left
    if (auto const written = write_file(AT_FDCWD, fresh.c_str(), bytes, 0600); !written) {
        ::unlink(fresh.c_str());
        return written;
    }
    fs::rename(fresh, path, failed);
    if (failed) {
        ::unlink(fresh.c_str());
        return Failure(errc::unavailable, failed.message());
    }
    return {};
}

class OwnKeptFile final : public KeptFile
{
public:
    OwnKeptFile(fs::path path, std::size_t limit)
        : path_(std::move(path)), limit_(limit), pool_(1, BlockingPool::Priority::background)
    {}

    result<std::string> read() const override { return read_file(AT_FDCWD, path_.c_str(), limit_); }

    boost::asio::awaitable<result<>> replace(std::string bytes) override
    {
        auto work = [path = path_, bytes = std::move(bytes)] { return replace_file(path, bytes); };
        return pool_.run(std::move(work));
    }

private:
    fs::path path_;
    std::size_t limit_;
    BlockingPool pool_;
};

} // namespace

std::unique_ptr<KeptFile> make_kept_file(fs::path path, std::size_t limit)
{
    return std::make_unique<OwnKeptFile>(std::move(path), limit);
}

} // namespace webots_cloud::adapters
