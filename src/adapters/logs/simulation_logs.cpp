// A thread writes what simulators print, since a disk may be slow or full. Each file keeps the beginning and
// the end of the output; old files are removed by name and age, and only those that are ours.
#include "adapters/files/output_file.hpp"
#include "adapters/threads/worker_threads.hpp"
#include "core/simulation/simulation_log.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"

#include <webots_cloud/adapters/logs.hpp>

#include <boost/asio/post.hpp>

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <system_error>

namespace webots_cloud {
namespace {

namespace asio = boost::asio;
namespace fs = std::filesystem;
using core::concat;

constexpr std::size_t first_bytes = 512 * 1024; // of each file, and then
constexpr std::size_t last_bytes = 64 * 1024;   // these, which wait in memory until the end
constexpr std::size_t max_line_length = 4096;
constexpr int max_waiting_lines = 2048; // lines: a disk that stalls costs lines, never memory
constexpr std::size_t max_logs = 1000;
constexpr auto removal_interval = std::chrono::hours(24);

/// The thread that writes, and what is shared with it.
struct Writer
{
    asio::any_io_executor executor; ///< Of the log.
    Logger log;
    std::atomic<int> waiting = 0;
    adapters::WorkerThreads thread{1};

    void complain(fs::path const& path, std::string_view what, std::string_view why)
    {
        auto text = concat("Simulation log ", path.string(), " ", what, ": ", why);
        asio::post(executor,
                   [log = log, text = std::move(text)] { log.error(LogCause("simulation log"), text); });
    }

    void warn(std::string text)
    {
        asio::post(executor,
                   [log = log, text = std::move(text)] { log.warning(LogCause("simulation log"), text); });
    }
};

/// A file of the writer's thread.
class WrittenFile
{
public:
    WrittenFile(Writer& writer, fs::path path) : writer_(writer), path_(std::move(path)) {}
    WrittenFile(WrittenFile const&) = delete;
    WrittenFile& operator=(WrittenFile const&) = delete;

    void open()
    {
        auto opened = adapters::open_output(path_, adapters::OutputMode::append, 0640);
        if (!opened)
            return writer_.complain(path_, "cannot be created", opened.error().message());
        file_ = std::move(opened->file);
        if (!opened->notice.empty())
            writer_.warn(std::move(opened->notice));
    }

    void write(std::string_view text)
    {
        while (file_ && !text.empty()) {
            auto const written = ::write(file_.get(), text.data(), text.size());
            if (written > 0) {
                text.remove_prefix(static_cast<std::size_t>(written));
            } else if (errno != EINTR) {
                writer_.complain(path_, "cannot be written",
                                 std::error_code(errno, std::generic_category()).message());
                file_ = adapters::FileDescriptor();
            }
        }
    }

private:
    Writer& writer_;
    fs::path path_;
    adapters::FileDescriptor file_;
};

/// What one simulation prints. It never waits for the disk.
class FileSimulationLog final : public SimulationLog
{
public:
    FileSimulationLog(Writer& writer, Clock& clock, fs::path const& path)
        : writer_(writer), clock_(clock), name_(path.filename()),
          file_(std::make_shared<WrittenFile>(writer, path)), kept_(first_bytes, last_bytes)
    {
        writer_.thread.post([file = file_] { file->open(); });
    }

    ~FileSimulationLog() override
    {
        if (lost_ > 0)
            kept_.take(concat("[", std::to_string(lost_), " lines are lost: the disk was too slow]"));
        writer_.thread.post([file = std::move(file_), text = kept_.finish()] { file->write(text); });
    }

    std::string const& name() const noexcept override { return name_; }

    void write(std::string_view line) override
    {
        auto text =
            kept_.take(concat(core::local_time(clock_.wall()), "  ", core::printable(line, max_line_length)));
        if (text.empty())
            return;
        if (writer_.waiting >= max_waiting_lines) {
            ++lost_;
            return;
        }
        ++writer_.waiting;
        writer_.thread.post([&writer = writer_, file = file_, text = std::move(text)] {
            file->write(text);
            --writer.waiting;
        });
    }

private:
    Writer& writer_;
    Clock& clock_;
    std::string name_;
    std::shared_ptr<WrittenFile> file_;
    core::KeptOutput kept_;
    std::uint64_t lost_ = 0; ///< Lines.
};

/// Removes what is too old or too much, and nothing that is not a simulation's log.
void remove_outdated(fs::path const& folder, Duration keep, std::size_t max)
{
    std::error_code failed;
    std::vector<core::SimulationLogFile> files;
    auto const now = fs::file_time_type::clock::now();
    for (auto entry = fs::directory_iterator(folder, failed); !failed && entry != fs::end(entry);
         entry.increment(failed)) {
        std::error_code gone;
        auto const name = entry->path().filename().string();
        auto const written = entry->last_write_time(gone);
        if (!gone && core::is_simulation_log_name(name) &&
            entry->symlink_status(gone).type() == fs::file_type::regular)
            files.emplace_back(name, std::chrono::duration_cast<Duration>(now - written));
    }
    for (auto const& name : core::outdated_logs(std::move(files), keep, max))
        fs::remove(folder / name, failed);
}

/// The folder of these files. Old ones go when a new one begins, and once a day.
class FileSimulationLogs final : public SimulationLogs
{
public:
    FileSimulationLogs(asio::any_io_executor executor, fs::path folder, Duration keep, Clock& clock,
                       Logger log)
        : folder_(std::move(folder)), keep_(keep), clock_(clock)
    {
        writer_.executor = std::move(executor);
        writer_.log = std::move(log);
    }

    ~FileSimulationLogs() override { writer_.thread.join(); }

    std::unique_ptr<SimulationLog> open(std::uint64_t simulation) override
    {
        auto const name = core::simulation_log_name(core::local_time(clock_.wall()), simulation);
        auto log = std::make_unique<FileSimulationLog>(writer_, clock_, folder_ / name);
        post_removal();
        return log;
    }

    asio::awaitable<result<>> run() override
    {
        for (;;) {
            post_removal();
            auto const waited = co_await clock_.wait_until(clock_.now() + removal_interval);
            if (!waited)
                co_return waited;
        }
    }

private:
    void post_removal()
    {
        writer_.thread.post([folder = folder_, keep = keep_] { remove_outdated(folder, keep, max_logs); });
    }

    fs::path const folder_;
    Duration const keep_;
    Clock& clock_;
    Writer writer_;
};

} // namespace

std::unique_ptr<SimulationLogs> make_simulation_logs(asio::any_io_executor executor, fs::path folder,
                                                     Duration keep, Clock& clock, Logger log)
{
    return std::make_unique<FileSimulationLogs>(std::move(executor), std::move(folder), keep, clock,
                                                std::move(log));
}

} // namespace webots_cloud
