// The fields of a form that a browser, or a simulation server, sends in the body of a POST request.
#pragma once

#include <webots_cloud/error.hpp>

#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace website_host {

/// Values by name. Of fields with the same name the last one counts, as in PHP.
using Form = std::map<std::string, std::string, std::less<>>;

/// Of `application/x-www-form-urlencoded` (also where there is no type) and `multipart/form-data`.
///
/// Errors: `invalid_argument`.
webots_cloud::result<Form> parse_form(std::string_view content_type, std::string_view body);

/// `%41` becomes `A`; a percent sign without two digits stays as it is.
std::string percent_decoded(std::string_view text);

} // namespace website_host
