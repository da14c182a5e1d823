#include "rotating_file.hpp"

#include "regular_file.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <string>

namespace webots_cloud::adapters {

RotatingFile::RotatingFile(std::filesystem::path file, std::size_t size, int old_files)
    : file_(std::move(file)), most_(size), old_files_(old_files)
{
    open(false);
}

void RotatingFile::open(bool empty)
{
    auto opened = open_to_append(file_, empty);
    if (!opened)
        throw spdlog::spdlog_ex(opened.error().message());
    open_ = std::move(*opened);
    struct stat status;
    size_ = ::fstat(open_.get(), &status) == 0 ? static_cast<std::size_t>(status.st_size) : 0;
}

void RotatingFile::sink_it_(spdlog::details::log_msg const& message)
{
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (size_ > 0 && size_ + line.size() > most_)
        rotate();
    if (!open_)
        open(false);
    write({line.data(), line.size()});
}

void RotatingFile::write(std::string_view text)
{
    while (!text.empty()) {
        auto const written = ::write(open_.get(), text.data(), text.size());
        if (written < 0 && errno == EINTR)
            continue;
        if (written < 0)
            throw spdlog::spdlog_ex("Failed writing to file " + file_.string(), errno);
        text.remove_prefix(static_cast<std::size_t>(written));
        size_ += static_cast<std::size_t>(written);
    }
}

void RotatingFile::rotate()
{
    open_ = FileDescriptor();
    std::error_code
        ignored; // a name that is not there, or can't be changed: the log goes on, and stays bounded
    for (int age = old_files_; age > 0; --age)
        std::filesystem::rename(name(age - 1), name(age), ignored);
    size_ = 0;
    open(true);
}

std::filesystem::path RotatingFile::name(int age) const
{
    auto name = file_;
    if (age > 0)
        name += "." + std::to_string(age);
    return name;
}

} // namespace webots_cloud::adapters
