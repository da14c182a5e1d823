#include "web_form.hpp"

#include <boost/url/encode.hpp>
#include <boost/url/rfc/unreserved_chars.hpp>

namespace webots_cloud::core {

std::string web_form(std::initializer_list<std::pair<std::string_view, std::string_view>> fields)
{
    std::string form;
    for (auto const& [name, value] : fields) {
        form.append(form.empty() ? "" : "&").append(name).append("=");
        form.append(boost::urls::encode(value, boost::urls::unreserved_chars));
    }
    return form;
}

} // namespace webots_cloud::core
