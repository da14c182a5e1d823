// In which language somebody wants a page, and what it says there.
#pragma once

#include <boost/json/object.hpp>

#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The one of `offered` that the header Accept-Language (RFC 9110, section 12.5.4) wants most, the earlier
/// one of two wanted alike; the first of `offered` when it wants none. German of Austria ("de-AT") is German
/// ("de"). Precondition: `offered` is not empty, and has small letters.
std::string_view preferred_language(std::string_view accept_language,
                                    std::vector<std::string_view> const& offered);

/// Sentences in English, with what they are in other languages.
class Translations
{
public:
    Translations() = default;

    /// `{"<sentence>": {"de": "<in German>", ...}, ...}`. Precondition: it is of this form, as files of ours
    /// are.
    explicit Translations(std::string_view json);

    /// English, and those that the sentence has been translated to.
    std::vector<std::string_view> languages_of(std::string_view sentence) const;

    /// The sentence itself where it has not been translated.
    std::string_view in(std::string_view language, std::string_view sentence) const;

private:
    boost::json::object sentences_;
};

} // namespace webots_cloud::core
