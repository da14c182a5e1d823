#include "download.hpp"

#include "adapters/files/project_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace webots_cloud::adapters {
namespace {

constexpr std::uint64_t memory_of_download = std::uint64_t{2} << 20; // buffers, also of who reads the file

result<FileDescriptor> make_nameless_file(int folder)
{
    constexpr auto* name = ".download";
    FileDescriptor file(::openat(folder, name, O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
    if (!file || ::unlinkat(folder, name, 0) != 0)
        return disk_failure();
    return file;
}

} // namespace

result<Download> download(CurlHttp& http, CurlRequest request, CurlLimits const& limits, int folder,
                          FetchShare& share, FetchProgress& progress)
{
    FetchBytes price;
    price.memory = memory_of_download;
    if (auto const taken = share.take(price); !taken)
        return taken.error();
    auto file = make_nameless_file(folder);
    if (!file)
        return file.error();
    Download made;
    made.file = std::move(*file);
    progress.bytes_received = 0;
    request.sink = [&](std::string_view bytes) -> result<> {
        made.beginning.append(bytes.substr(0, Download::beginning_size - made.beginning.size()));
        progress.bytes_received += bytes.size();
        FetchBytes piece;
        piece.disk = bytes.size();
        if (auto const taken = share.take(piece); !taken)
            return taken;
        return write_all(made.file.get(), bytes);
    };
    auto const status = http.send(request, limits);
    if (!status)
        return status.error();
    made.status = *status;
    return made;
}

} // namespace webots_cloud::adapters
