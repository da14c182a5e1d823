#include "git_pipe.hpp"

#include <boost/asio/error.hpp>

#include <algorithm>

namespace webots_cloud::adapters {
namespace {

constexpr std::size_t room = std::size_t{1} << 20; // plus one piece, which is as large as libcurl makes it

} // namespace

result<> GitPipe::write(std::string_view bytes)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return left_ || bytes_.size() - used_ < room; });
    if (left_)
        return Failure(boost::asio::error::operation_aborted);
    bytes_.erase(0, used_);
    used_ = 0;
    bytes_.append(bytes);
    changed_.notify_all();
    return {};
}

void GitPipe::end(result<> outcome)
{
    std::lock_guard const lock(mutex_);
    ended_ = true;
    outcome_ = std::move(outcome);
    changed_.notify_all();
}

result<std::size_t> GitPipe::read(char* buffer, std::size_t size)
{
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return ended_ || used_ < bytes_.size(); });
    if (used_ == bytes_.size() && outcome_.has_error())
        return outcome_.error();
    auto const count = std::min(size, bytes_.size() - used_);
    std::copy_n(bytes_.data() + used_, count, buffer);
    used_ += count;
    changed_.notify_all();
    return count;
}

void GitPipe::leave()
{
    std::lock_guard const lock(mutex_);
    left_ = true;
    changed_.notify_all();
}

} // namespace webots_cloud::adapters
