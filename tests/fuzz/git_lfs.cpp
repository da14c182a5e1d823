// Git LFS: a file that may be a pointer, and what a server says of objects. What comes out of either goes
// into requests.
#include "fuzz.hpp"

#include "core/git/git_lfs_address.hpp"
#include "core/git/git_lfs_batch.hpp"
#include "core/git/git_lfs_pointer.hpp"
#include "core/text.hpp"

#include <algorithm>
#include <string>
#include <vector>

using namespace webots_cloud;

namespace {

constexpr std::string_view forge = "https://forge.org";

bool is_digest(std::string_view text)
{
    return text.size() == 64 && text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

void read_pointer(std::string_view text)
{
    auto const pointer = core::parse_lfs_pointer(text);
    if (!pointer)
        return;
    fuzz::require(text.size() <= core::max_lfs_pointer_length && is_digest(pointer->object));
    fuzz::require(static_cast<std::int64_t>(pointer->size) >= 0);
    auto const plain = "version https://git-lfs.github.com/spec/v1\noid sha256:" + pointer->object +
                       "\nsize " + std::to_string(pointer->size) + "\n";
    auto const again = core::parse_lfs_pointer(plain);
    fuzz::require(again && again->object == pointer->object && again->size == pointer->size &&
                  !again->extended);
}

void read_batch(std::string_view text)
{
    std::vector<core::LfsPointer> objects(2);
    objects[0].object = std::string(64, 'a');
    objects[0].size = 5;
    objects[1].object = std::string(64, 'b');
    objects[1].size = 7;
    auto const downloads = core::parse_lfs_batch(text, objects);
    if (!downloads)
        return fuzz::require(core::is_printable(downloads.error().message()));
    fuzz::require(downloads->size() == objects.size());
    for (auto const& download : *downloads) {
        fuzz::require(core::is_printable(download.address) && core::is_printable(download.words));
        fuzz::require(download.headers.size() <= 32);
        for (auto const& line : download.headers)
            fuzz::require(core::is_printable(line) && line.find(": ") != std::string::npos);
    }
}

void read_address(std::string_view text)
{
    if (!core::check_lfs_address(text, forge))
        return;
    auto const base = core::base_of(text);
    fuzz::require(base.size() > 8 && base.find('@') == std::string_view::npos);
    fuzz::require(core::is_printable(text) && text.find(' ') == std::string_view::npos);
}

} // namespace

int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size)
{
    auto const text = fuzz::text_of(data, size);
    read_pointer(text);
    read_batch(text);
    read_address(text);
    return 0;
}
