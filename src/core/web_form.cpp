#include "web_form.hpp"

#include <boost/url/encode.hpp>
#include <boost/url/rfc/unreserved_chars.hpp>

namespace webots_cloud::core {

std::string percent_encode(std::string_view text)
{
    return boost::urls::encode(text, boost::urls::unreserved_chars);
}

std::string web_form(std::initializer_list<std::pair<std::string_view, std::string_view>> fields)
{
    std::string form;
    for (auto const& [name, value] : fields) {
        form.append(form.empty() ? "" : "&").append(name).append("=");
        form.append(percent_encode(value));
    }
    return form;
}

} // namespace webots_cloud::core
