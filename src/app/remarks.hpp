// What the operator is told of what was tried on this machine, in the order in which it was found out.
#pragma once

#include <webots_cloud/transport/logger.hpp>

#include <string>
#include <utility>
#include <vector>

namespace webots_cloud::app {

/// A sentence for the log.
struct Remark
{
    Remark(LogLevel level, std::string text) : level(level), text(std::move(text)) {}

    LogLevel level; ///< `info`, or `warning` where something is missing.
    std::string text;
};

class Remarks
{
public:
    void note(std::string text) { all_.emplace_back(LogLevel::info, std::move(text)); }
    void warn(std::string text) { all_.emplace_back(LogLevel::warning, std::move(text)); }
    void add(Remarks const& others) { all_.insert(all_.end(), others.all_.begin(), others.all_.end()); }

    std::vector<std::string> warnings() const
    {
        std::vector<std::string> texts;
        for (auto const& remark : all_)
            if (remark.level == LogLevel::warning)
                texts.push_back(remark.text);
        return texts;
    }

    void tell(Logger const& log) const
    {
        for (auto const& remark : all_)
            log.write(remark.level, remark.text);
    }

private:
    std::vector<Remark> all_;
};

} // namespace webots_cloud::app
