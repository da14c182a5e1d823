// What world files say of themselves, and what machines and simulators show of them: whatever that is, the
// gallery has short lines of text that can be seen, and addresses of worlds.
#include "fuzz.hpp"

#include "core/gallery/world_list.hpp"
#include "core/projects/world_info.hpp"
#include "core/simulation/first_picture.hpp"
#include "core/text.hpp"

using namespace webots_cloud;

namespace {

void check_line(std::string_view line, std::size_t limit)
{
    fuzz::require(line.size() <= limit && core::is_utf8(line) && core::one_line(line, limit) == line);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    auto const info = core::world_info(text);
    check_line(info.title, 100);
    check_line(info.text, 200);
    check_line(core::title_of_address(text), 100);
    auto const picture = core::first_picture(text);
    bool const is_found = picture.state == core::FirstPicture::State::found;
    fuzz::require(is_found == core::is_world_picture(picture.picture) &&
                  picture.picture.size() <= text.size());
    for (auto const& key : core::parse_picture_keys(text))
        fuzz::require(key.size() == 16 && key.find_first_not_of("0123456789abcdef") == std::string::npos);
    if (auto const error = core::parse_world_list_error(text))
        fuzz::require(core::is_printable(*error));
    auto const worlds = core::parse_world_list(text);
    if (!worlds)
        return 0;
    fuzz::require(worlds->size() <= core::max_listed_worlds);
    for (auto const& world : *worlds) {
        fuzz::require(core::is_world_link(world.url) && core::is_printable(world.url));
        fuzz::require(!world.url.starts_with("ws:") && !world.url.starts_with("wss:"));
        check_line(world.title, 100);
        check_line(world.text, 200);
    }
    auto const again = core::parse_world_list(core::world_list_json(*worlds));
    fuzz::require(again && *again == *worlds);
    fuzz::require(core::gallery_worlds(std::nullopt, text, *worlds).size() <= core::max_listed_worlds);
    return 0;
}
