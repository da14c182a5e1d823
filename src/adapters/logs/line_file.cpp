#include "line_file.hpp"

#include "adapters/files/output_file.hpp"
#include "adapters/threads/worker_threads.hpp"
#include "core/text.hpp"

#include <boost/asio/post.hpp>

#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <memory>
#include <system_error>

namespace webots_cloud::adapters {
namespace {

namespace asio = boost::asio;

constexpr mode_t line_file_mode = 0666; // less what the umask takes
constexpr int max_waiting = 64;         // a disk that stalls costs lines, never memory

std::string last_problem()
{
    return std::error_code(errno, std::generic_category()).message();
}

/// Shared by the copies of the function; its destructor waits for the lines that are under way.
class LineFile
{
public:
    LineFile(asio::any_io_executor executor, std::string name, std::filesystem::path path,
             FileDescriptor file, std::string first_line, std::size_t max, Logger log)
        : executor_(std::move(executor)), name_(std::move(name)), path_(std::move(path)),
          first_line_(std::move(first_line)), max_(max), log_(std::move(log)), file_(std::move(file))
    {
        append(first_line_);
    }

    ~LineFile() { writer_.join(); }

    void append(std::string line)
    {
        if (waiting_ >= max_waiting)
            return;
        ++waiting_;
        writer_.post([this, line = std::move(line)] {
            if (size_ > first_line_.size() && size_ + line.size() > max_)
                rotate();
            write(line);
            --waiting_;
        });
    }

private:
    void write(std::string_view text)
    {
        while (file_ && !text.empty()) {
            auto const written = ::write(file_.get(), text.data(), text.size());
            if (written >= 0) {
                text.remove_prefix(static_cast<std::size_t>(written));
                size_ += static_cast<std::size_t>(written);
            } else if (errno != EINTR) {
                give_up(last_problem());
            }
        }
    }

    /// Whatever keeps its name from being changed, the file stays bounded.
    void rotate()
    {
        auto old = path_;
        old += ".1";
        std::error_code ignored;
        std::filesystem::rename(path_, old, ignored);
        auto opened = open_output(path_, OutputMode::anew, line_file_mode);
        if (!opened)
            return give_up(opened.error().message());
        file_ = std::move(opened->file);
        size_ = 0;
        write(first_line_);
    }

    void give_up(std::string_view why)
    {
        auto const text = core::concat(name_, " cannot be written: ", why);
        file_ = FileDescriptor();
        asio::post(executor_, [log = log_, text] { log.error(text); });
    }

    asio::any_io_executor executor_;
    std::string name_; ///< In sentences, with its path.
    std::filesystem::path path_;
    std::string first_line_;
    std::size_t max_;
    Logger log_;
    // The writer's, once that has begun.
    FileDescriptor file_;
    std::size_t size_ = 0;
    std::atomic<int> waiting_ = 0;
    WorkerThreads writer_{1};
};

} // namespace

std::function<void(std::string line)> make_line_file(asio::any_io_executor executor, std::string name,
                                                     std::filesystem::path file, std::string first_line,
                                                     Logger log, std::size_t max_bytes)
{
    name += " " + file.string();
    auto opened = open_output(file, OutputMode::anew, line_file_mode);
    if (!opened) {
        log.error(core::concat(name, " cannot be created: ", opened.error().message()));
        return {};
    }
    if (!opened->notice.empty())
        log.warning(opened->notice);
    auto const lines =
        std::make_shared<LineFile>(std::move(executor), std::move(name), std::move(file),
                                   std::move(opened->file), std::move(first_line), max_bytes, log);
    return [lines](std::string line) { lines->append(std::move(line)); };
}

} // namespace webots_cloud::adapters
