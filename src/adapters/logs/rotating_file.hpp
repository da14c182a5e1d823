// A log file that is set aside when it is full, under the names that operators know.
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
/// spdlog_ex when the file can't be opened or written.
///
/// What is in the way of a file is set aside, and the next line says so.
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

    void open();
    void write(spdlog::memory_buf_t const& line);
    void rotate();
    std::filesystem::path name(int age) const;

    std::filesystem::path file_;
    std::size_t most_;
    int old_files_;
    FileDescriptor open_;
    std::string notice_; ///< Not written yet.
    std::size_t size_ = 0;
};

} // namespace webots_cloud::adapters
