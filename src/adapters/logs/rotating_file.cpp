// Writes lines to a file, and begins a new one when it is full, or when its name leads to another file.
// Where the disk is full, lines are lost, and nobody is held up.
#include "rotating_file.hpp"

#include "core/text.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string_view>
#include <utility>

namespace webots_cloud::adapters {
namespace {

constexpr mode_t permissions = 0666; // less what the umask takes

/// Not configurable.
bool may_pass(boost::system::error_code why) noexcept
{
    if (why.category() != boost::system::system_category())
        return false;
    auto const error = why.value();
    return error == ENOSPC || error == EDQUOT || error == EIO || error == EMFILE || error == ENFILE ||
           error == ENOMEM;
}

result<> write_all(int file, std::string_view left, std::size_t& size)
{
    while (!left.empty()) {
        auto const written = ::write(file, left.data(), left.size());
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            return Failure(boost::system::error_code(errno, boost::system::system_category()));
        size += static_cast<std::size_t>(written);
        left.remove_prefix(static_cast<std::size_t>(written));
    }
    return {};
}

spdlog::details::log_msg warning_beside(spdlog::details::log_msg const& message, std::string_view text)
{
    spdlog::details::log_msg warning(message.logger_name, spdlog::level::warn, {text.data(), text.size()});
    warning.time = message.time;
    return warning;
}

} // namespace

RotatingFile::RotatingFile(std::filesystem::path file, std::size_t size, int old_files)
    : file_(std::move(file)), max_(size), old_files_(old_files)
{
    auto const opened = open();
    if (!opened && !may_pass(opened.error().code()))
        throw spdlog::spdlog_ex(opened.error().message());
}

result<> RotatingFile::open()
{
    auto opened = open_output(file_, OutputMode::append, permissions);
    if (!opened)
        return opened.error();
    open_ = std::move(opened->file);
    notice_ = std::move(opened->notice);
    struct stat status;
    size_ = ::fstat(open_.get(), &status) == 0 ? static_cast<std::size_t>(status.st_size) : 0;
    return {};
}

void RotatingFile::sink_it_(spdlog::details::log_msg const& message)
{
    auto const written = append(message);
    if (written) {
        problem_.clear();
        return;
    }
    auto why = written.error().message();
    spdlog::memory_buf_t lines;
    if (why != problem_)
        formatter_->format(
            warning_beside(message, core::concat("Log file ", file_.string(), " cannot be written: ", why,
                                                 ". Until it can, its lines go to standard error.")),
            lines);
    problem_ = std::move(why);
    formatter_->format(message, lines);
    std::size_t ignored = 0;
    (void)write_all(STDERR_FILENO, {lines.data(), lines.size()}, ignored); // where else could we say it?
}

result<> RotatingFile::append(spdlog::details::log_msg const& message)
{
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    // Another program may have moved the file away: then a new one begins.
    follow_name();
    if (size_ > 0 && size_ + line.size() > max_)
        rotate();
    if (!open_)
        if (auto const opened = open(); !opened)
            return opened;
    if (!problem_.empty() && notice_.empty())
        notice_ = core::concat("Lines are missing here, and went to standard error: ", problem_);
    if (!notice_.empty()) {
        spdlog::memory_buf_t text;
        formatter_->format(warning_beside(message, notice_), text);
        if (auto const written = write(text); !written)
            return written;
        notice_.clear();
    }
    return write(line);
}

/// Where the name's new file can't be opened, as in a folder that took the place of ours, the old one stays.
void RotatingFile::follow_name()
{
    struct stat named
    {};
    struct stat opened
    {};
    if (!open_ || ::fstat(open_.get(), &opened) != 0)
        return;
    bool const is_there = ::lstat(file_.c_str(), &named) == 0;
    if (!is_there || named.st_ino != opened.st_ino || named.st_dev != opened.st_dev)
        (void)open();
}

result<> RotatingFile::write(spdlog::memory_buf_t const& line)
{
    return write_all(open_.get(), {line.data(), line.size()}, size_);
}

/// `append` opens the next one.
void RotatingFile::rotate()
{
    open_ = FileDescriptor();
    size_ = 0;
    std::error_code
        ignored; // a name that is not there, or can't be changed: the log goes on, and stays bounded
    for (int age = old_files_; age > 0; --age)
        std::filesystem::rename(name(age - 1), name(age), ignored);
    struct stat status;
    if (::lstat(file_.c_str(), &status) == 0 && S_ISREG(status.st_mode))
        ::unlink(file_.c_str());
}

std::filesystem::path RotatingFile::name(int age) const
{
    auto name = file_;
    if (age > 0)
        name += "." + std::to_string(age);
    return name;
}

} // namespace webots_cloud::adapters
