#include "rotating_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace webots_cloud::adapters {
namespace {

constexpr mode_t permissions = 0666; // less what the umask takes

} // namespace

RotatingFile::RotatingFile(std::filesystem::path file, std::size_t size, int old_files)
    : file_(std::move(file)), most_(size), old_files_(old_files)
{
    open();
}

void RotatingFile::open()
{
    auto opened = open_output(file_, OutputMode::append, permissions);
    if (!opened)
        throw spdlog::spdlog_ex(opened.error().message());
    open_ = std::move(opened->file);
    notice_ = std::move(opened->notice);
    struct stat status;
    size_ = ::fstat(open_.get(), &status) == 0 ? static_cast<std::size_t>(status.st_size) : 0;
}

void RotatingFile::write(spdlog::memory_buf_t const& line)
{
    std::string_view left(line.data(), line.size());
    while (!left.empty()) {
        auto const written = ::write(open_.get(), left.data(), left.size());
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            throw spdlog::spdlog_ex("can't write to " + file_.string(), errno);
        size_ += static_cast<std::size_t>(written);
        left.remove_prefix(static_cast<std::size_t>(written));
    }
}

void RotatingFile::sink_it_(spdlog::details::log_msg const& message)
{
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (size_ > 0 && size_ + line.size() > most_)
        rotate();
    if (!open_)
        open(); // the last attempt has failed
    if (!notice_.empty()) {
        spdlog::memory_buf_t text;
        auto const notice = std::move(notice_);
        notice_.clear();
        formatter_->format(spdlog::details::log_msg(message.logger_name, spdlog::level::warn, notice), text);
        write(text);
    }
    write(line);
}

void RotatingFile::rotate()
{
    open_ = FileDescriptor();
    std::error_code
        ignored; // a name that is not there, or can't be changed: the log goes on, and stays bounded
    for (int age = old_files_; age > 0; --age)
        std::filesystem::rename(name(age - 1), name(age), ignored);
    struct stat status;
    if (::lstat(file_.c_str(), &status) == 0 && S_ISREG(status.st_mode))
        ::unlink(file_.c_str());
    open();
}

std::filesystem::path RotatingFile::name(int age) const
{
    auto name = file_;
    if (age > 0)
        name += "." + std::to_string(age);
    return name;
}

} // namespace webots_cloud::adapters
