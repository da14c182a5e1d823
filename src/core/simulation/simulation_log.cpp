#include "simulation_log.hpp"

#include "core/text.hpp"

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr std::string_view extension = ".log";

} // namespace

std::string simulation_log_name(std::string_view time, std::uint64_t id)
{
    auto name = concat(time, "_", std::to_string(id), extension);
    std::replace(name.begin(), name.end(), ' ', '_');
    std::replace(name.begin(), name.end(), ':', '-');
    return name;
}

bool is_simulation_log_name(std::string_view name) noexcept
{
    constexpr std::string_view shape = "dddd-dd-dd_dd-dd-dd_";
    constexpr std::string_view digits = "0123456789";
    if (name.size() <= shape.size() + extension.size() || !name.ends_with(extension))
        return false;
    for (std::size_t i = 0; i < shape.size(); ++i)
        if (shape[i] == 'd' ? digits.find(name[i]) == std::string_view::npos : name[i] != shape[i])
            return false;
    auto const id = name.substr(shape.size(), name.size() - shape.size() - extension.size());
    return id.find_first_not_of(digits) == std::string_view::npos;
}

std::string KeptOutput::take(std::string line)
{
    line += '\n';
    if (line.size() <= first_left_) {
        first_left_ -= line.size();
        return line;
    }
    first_left_ = 0;
    size_of_last_ += line.size();
    last_.push_back(std::move(line));
    for (; size_of_last_ > last_bytes_; ++left_out_) {
        size_of_last_ -= last_.front().size();
        last_.pop_front();
    }
    return {};
}

std::string KeptOutput::finish()
{
    std::string text;
    if (left_out_ > 0)
        text = concat("[", std::to_string(left_out_), " lines are left out here]\n");
    for (auto const& line : last_)
        text += line;
    last_.clear();
    size_of_last_ = 0;
    left_out_ = 0;
    return text;
}

std::vector<std::string> outdated_logs(std::vector<SimulationLogFile> files, Duration keep, std::size_t max)
{
    std::stable_sort(files.begin(), files.end(),
                     [](auto const& left, auto const& right) { return left.age < right.age; });
    std::vector<std::string> outdated;
    for (std::size_t i = 0; i < files.size(); ++i)
        if (i >= max || files[i].age > keep)
            outdated.push_back(std::move(files[i].name));
    return outdated;
}

} // namespace webots_cloud::core
