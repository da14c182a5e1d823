#include "page_language.hpp"

#include "core/text.hpp"

#include <boost/json/parse.hpp>

#include <algorithm>

namespace webots_cloud::core {
namespace {

constexpr int full_weight = 1000;

/// In thousandths, of what follows the name of a language: `q=0.8`. What can't be read weighs nothing.
int weight_of(std::string_view parameter)
{
    if (parameter.empty())
        return full_weight;
    if (!parameter.starts_with("q=0") && !parameter.starts_with("q=1"))
        return 0;
    if (parameter[2] == '1')
        return full_weight;
    int weight = 0;
    int place = full_weight;
    for (char const digit : parameter.substr(std::min<std::size_t>(4, parameter.size()))) {
        if (digit < '0' || digit > '9')
            break;
        place /= 10;
        weight += place * (digit - '0');
    }
    return weight;
}

} // namespace

std::string_view preferred_language(std::string_view accept_language,
                                    std::vector<std::string_view> const& offered)
{
    std::string_view best = offered.front();
    int best_weight = 0;
    for (auto const part : split(accept_language, ',')) {
        auto const end = std::min(part.find(';'), part.size());
        auto const tag = trim(part.substr(0, end));
        auto const language = lower_case(tag.substr(0, tag.find('-')));
        auto const weight = weight_of(trim(part.substr(std::min(end + 1, part.size()))));
        auto const found = std::ranges::find(offered, language);
        if (found != offered.end() && weight > best_weight) {
            best = *found;
            best_weight = weight;
        }
    }
    return best;
}

Translations::Translations(std::string_view json) : sentences_(boost::json::parse(json).as_object()) {}

std::vector<std::string_view> Translations::languages_of(std::string_view sentence) const
{
    std::vector<std::string_view> languages{"en"};
    if (auto const* const found = sentences_.if_contains(sentence))
        for (auto const& translation : found->as_object())
            languages.push_back(translation.key());
    return languages;
}

std::string_view Translations::in(std::string_view language, std::string_view sentence) const
{
    auto const* const found = sentences_.if_contains(sentence);
    auto const* const translation = found ? found->as_object().if_contains(language) : nullptr;
    return translation ? std::string_view(translation->as_string()) : sentence;
}

} // namespace webots_cloud::core
