// In which language somebody wants a page, by the header Accept-Language (RFC 9110, section 12.5.4).
#pragma once

#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The one of `offered` that is wanted most, the earlier one of two wanted alike; the first of `offered` when
/// none is. German of Austria ("de-AT") is German ("de"). Precondition: `offered` is not empty, and has small
/// letters.
std::string_view preferred_language(std::string_view accept_language,
                                    std::vector<std::string_view> const& offered);

} // namespace webots_cloud::core
