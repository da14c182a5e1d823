#include "adapters/files/output_file.hpp"
#include "adapters/threads/worker_threads.hpp"
#include "core/text.hpp"

#include <webots_cloud/adapters/logs.hpp>

#include <boost/asio/post.hpp>

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <memory>
#include <system_error>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;

constexpr int max_waiting = 64; // a disk that stalls costs lines, never memory

std::string last_problem()
{
    return std::error_code(errno, std::generic_category()).message();
}

/// Shared by the copies of the function; its destructor waits for the lines that are under way.
class LineFile
{
public:
    LineFile(asio::any_io_executor executor, std::string name, adapters::FileDescriptor file, Logger log)
        : executor_(std::move(executor)), name_(std::move(name)), log_(std::move(log)), file_(std::move(file))
    {}

    ~LineFile() { writer_.join(); }

    void append(std::string line)
    {
        if (waiting_ >= max_waiting)
            return;
        ++waiting_;
        writer_.post([this, line = std::move(line)] {
            write(line);
            --waiting_;
        });
    }

private:
    void write(std::string_view text)
    {
        while (file_ && !text.empty()) {
            auto const written = ::write(file_.get(), text.data(), text.size());
            if (written >= 0)
                text.remove_prefix(static_cast<std::size_t>(written));
            else if (errno != EINTR)
                give_up();
        }
    }

    void give_up()
    {
        auto const text = core::concat(name_, " cannot be written: ", last_problem());
        file_ = adapters::FileDescriptor();
        asio::post(executor_, [log = log_, text] { log.error(text); });
    }

    asio::any_io_executor executor_;
    std::string name_; ///< In sentences, with its path.
    Logger log_;
    adapters::FileDescriptor file_; ///< The writer's, once that has begun.
    std::atomic<int> waiting_ = 0;
    adapters::WorkerThreads writer_{1};
};

} // namespace

std::function<void(std::string line)> make_line_file(asio::any_io_executor executor, std::string name,
                                                     std::filesystem::path file, std::string first_line,
                                                     Logger log)
{
    name += " " + file.string();
    auto opened = adapters::open_output(file, adapters::OutputMode::anew, 0666);
    if (!opened) {
        log.error(core::concat(name, " cannot be created: ", opened.error().message()));
        return {};
    }
    if (!opened->notice.empty())
        log.warning(opened->notice);
    auto const lines =
        std::make_shared<LineFile>(std::move(executor), std::move(name), std::move(opened->file), log);
    lines->append(std::move(first_line));
    return [lines](std::string line) { lines->append(std::move(line)); };
}

} // namespace webots_cloud
