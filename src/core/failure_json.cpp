#include "failure_json.hpp"

namespace webots_cloud::core {

boost::json::object values_of(Failure const& failure)
{
    boost::json::object values;
    if (auto const* const info = failure.info())
        for (auto const& [name, value] : info->arguments)
            values[name] = value;
    return values;
}

void add_failure(boost::json::object& object, Failure const& failure)
{
    object["error"] = failure.message();
    if (auto const* const info = failure.info()) {
        object["code"] = info->code;
        object["values"] = values_of(failure);
    }
}

} // namespace webots_cloud::core
