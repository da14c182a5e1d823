// A log file that is rotated when it is full, with the file names of the Python servers.
#pragma once

#include "adapters/files/output_file.hpp"

#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/base_sink.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace webots_cloud::adapters {

/// As Python's RotatingFileHandler names them: `output.log` is written, `output.log.1` is the last that was
/// full, and so on; spdlog's own sink has `output.1.log`, follows links, and waits for pipes. Throws
/// spdlog_ex when the file can't be opened until somebody fixes the cause.
///
/// A file that somebody has renamed or removed, as logrotate does, is left alone: the next line goes into the
/// one that has the name then, or into a new one.
///
/// Anything else with the file's name is renamed, and the next line says so. Lines that can't be written, as
/// on a full disk, go to standard error; the first one after them says so in the file.
///
/// Thread-safety: one thread.
class RotatingFile final : public spdlog::sinks::base_sink<spdlog::details::null_mutex>
{
public:
    /// `size` in bytes; `old_files` are kept. Folders are made.
    RotatingFile(std::filesystem::path file, std::size_t size, int old_files);

private:
    void sink_it_(spdlog::details::log_msg const& message) override;
    void flush_() override {} // every line is written at once

    result<> open();
    void follow_name();
    result<> append(spdlog::details::log_msg const& message);
    result<> write(spdlog::memory_buf_t const& line);
    void rotate();
    std::filesystem::path name(int age) const;

    std::filesystem::path file_;
    std::size_t max_;
    int old_files_;
    FileDescriptor open_;
    std::string notice_;  ///< Not written yet.
    std::string problem_; ///< Why lines go to standard error; empty: they don't.
    std::size_t size_ = 0;
};

} // namespace webots_cloud::adapters
