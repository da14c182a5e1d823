#include "rotating_file.hpp"

#include <string>

namespace webots_cloud::adapters {

RotatingFile::RotatingFile(std::filesystem::path file, std::size_t size, int old_files)
    : file_(std::move(file)), most_(size), old_files_(old_files)
{
    open_.open(file_.string());
    size_ = open_.size();
}

void RotatingFile::sink_it_(spdlog::details::log_msg const& message)
{
    spdlog::memory_buf_t line;
    formatter_->format(message, line);
    if (size_ > 0 && size_ + line.size() > most_)
        rotate();
    open_.write(line);
    size_ += line.size();
}

void RotatingFile::rotate()
{
    open_.close();
    std::error_code
        ignored; // a name that is not there, or can't be changed: the log goes on, and stays bounded
    for (int age = old_files_; age > 0; --age)
        std::filesystem::rename(name(age - 1), name(age), ignored);
    open_.open(file_.string(), true);
    size_ = 0;
}

std::filesystem::path RotatingFile::name(int age) const
{
    auto name = file_;
    if (age > 0)
        name += "." + std::to_string(age);
    return name;
}

} // namespace webots_cloud::adapters
