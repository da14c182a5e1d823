// Bodies of `application/x-www-form-urlencoded`.
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace webots_cloud::core {

inline constexpr std::string_view form_type = "application/x-www-form-urlencoded";

/// Any bytes as the value of a query or a form: all but letters, digits and `-._~` as `%XX`.
std::string percent_encode(std::string_view text);

/// `name=value&...`; names must be plain words, values may be any bytes.
std::string web_form(std::initializer_list<std::pair<std::string_view, std::string_view>> fields);

} // namespace webots_cloud::core
