// Forms as browsers send them to the example of a website: what is understood was in the body, and is
// bounded.
#include "fuzz.hpp"

#include "form.hpp"

#include <cstddef>

using namespace webots_cloud;

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto body = fuzz::text_of(data, size);
    auto const type = fuzz::take(body, fuzz::take_byte(body));
    auto const form = website_host::parse_form(type, body);
    if (!form) {
        fuzz::require(!form.error().message().empty());
        return 0;
    }
    fuzz::require(form->size() <= 32);
    std::size_t total = 0;
    for (auto const& [name, value] : *form) {
        fuzz::require(!name.empty() && name.size() <= 100);
        total += name.size() + value.size();
    }
    fuzz::require(total <= body.size());
    return 0;
}
