// Reads what docker says of images, and decides what a build has added and which images are to go. A step of
// a build can print what it likes: so names of its output are only looked up, and sizes come from docker.
#include "build_images.hpp"

#include "core/text.hpp"
#include "labels.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <tuple>

namespace webots_cloud::core {
namespace {

constexpr std::size_t short_id = 12;
// Docker builds 127 layers at most in a stage, and its sentences name each twice.
constexpr std::size_t max_names = 2000;
constexpr std::string_view id_prefix = "sha256:";

bool is_hexadecimal(std::string_view text) noexcept
{
    return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return hex_digit(c) >= 0; });
}

std::string_view digits_of(std::string_view id)
{
    return id.starts_with(id_prefix) ? id.substr(id_prefix.size()) : std::string_view();
}

bool is_image(std::string_view id) noexcept
{
    return id.size() == id_prefix.size() + 64 && is_hexadecimal(digits_of(id));
}

bool is_named(std::string_view id, std::set<std::string> const& names)
{
    return names.contains(std::string(digits_of(id).substr(0, short_id)));
}

std::uint64_t number_in(std::string_view text)
{
    std::uint64_t number = 0;
    auto const read = std::from_chars(text.data(), text.data() + text.size(), number);
    return read.ec == std::errc() ? number : 0;
}

/// Images, and how they are made from each other.
class Family
{
public:
    explicit Family(std::vector<BuiltImage> const& images)
    {
        for (auto const& image : images)
            images_[image.id] = &image;
        for (auto const& [id, image] : images_)
            if (auto const* parent = parent_of(*image))
                ++children_[parent->id];
    }

    BuiltImage const* parent_of(BuiltImage const& image) const
    {
        auto const found = images_.find(image.parent);
        return found == images_.end() || found->second == &image ? nullptr : found->second;
    }

    /// What its step has added.
    std::uint64_t added(BuiltImage const& image) const
    {
        auto const* parent = parent_of(image);
        return parent && image.size > parent->size ? image.size - parent->size : 0;
    }

    std::uint64_t added() const
    {
        std::uint64_t bytes = 0;
        for (auto const& [id, image] : images_)
            bytes += added(*image);
        return bytes;
    }

    /// Those that no other is made from, in the order of their making.
    std::vector<BuiltImage const*> last_ones() const
    {
        std::vector<BuiltImage const*> found;
        for (auto const& [id, image] : images_)
            if (!children_.contains(id))
                found.push_back(image);
        std::sort(found.begin(), found.end(), [](auto const* a, auto const* b) {
            return std::tie(a->created, a->id) < std::tie(b->created, b->id);
        });
        return found;
    }

    /// Takes one away that no other is made from.   Returns: the one before, if that is true of it now.
    BuiltImage const* take(BuiltImage const& last)
    {
        auto const* parent = parent_of(last);
        return parent && --children_[parent->id] == 0 ? parent : nullptr;
    }

private:
    std::map<std::string_view, BuiltImage const*> images_;
    std::map<std::string_view, std::size_t> children_;
};

} // namespace

void BuildRecord::read(std::string_view line)
{
    constexpr std::string_view arrow = "---> ";
    constexpr std::string_view running = "Running in ";
    line = trim(line);
    if (!line.starts_with(arrow))
        return;
    line.remove_prefix(arrow.size());
    if (line.starts_with(running))
        line.remove_prefix(running.size());
    if (line.size() != short_id || !is_hexadecimal(line))
        return;
    if (names_.size() < max_names)
        names_.emplace(line);
    else if (!names_.contains(std::string(line)))
        full_ = true;
}

std::vector<std::string> list_image_ids()
{
    return {"images", "--all", "--quiet", "--no-trunc"};
}

std::vector<std::string> list_built_ids(std::string_view identity)
{
    auto arguments = list_image_ids();
    arguments.emplace_back("--filter");
    arguments.push_back(concat("label=", server_label, "=", identity));
    return arguments;
}

std::vector<std::string> image_ids(std::string_view listing)
{
    std::set<std::string> ids; // an image with two names stands there twice
    for (auto const line : split(listing, '\n'))
        if (auto const id = trim(line); is_image(id))
            ids.emplace(id);
    return {ids.begin(), ids.end()};
}

std::vector<std::string> image_ids(std::string_view listing, std::set<std::string> const& names)
{
    auto ids = image_ids(listing);
    std::erase_if(ids, [&names](std::string const& id) { return !is_named(id, names); });
    return ids;
}

std::vector<std::string> describe_images(std::vector<std::string> const& ids)
{
    std::vector<std::string> arguments{"image", "inspect", "--format",
                                       "{{.Id}}\t{{.Parent}}\t{{.Size}}\t{{.Created}}"};
    arguments.insert(arguments.end(), ids.begin(), ids.end());
    return arguments;
}

std::vector<BuiltImage> read_images(std::string_view description)
{
    std::vector<BuiltImage> images;
    for (auto const line : split(description, '\n')) {
        auto const fields = split(line, '\t');
        if (fields.size() != 4 || !is_image(fields[0]))
            continue;
        auto& image = images.emplace_back();
        image.id = fields[0];
        image.parent = fields[1];
        image.size = number_in(fields[2]);
        image.created = trim(fields[3]);
    }
    return images;
}

std::uint64_t added_bytes(std::vector<BuiltImage> const& images)
{
    return Family(images).added();
}

std::vector<std::string> images_beyond(std::vector<BuiltImage> const& images, std::uint64_t max,
                                       std::set<std::string> const& in_use)
{
    Family family(images);
    auto kept = family.added();
    std::vector<std::string> beyond;
    for (auto const* last : family.last_ones()) {
        if (kept <= max)
            break;
        for (auto const* image = last; image && !is_named(image->id, in_use); image = family.take(*image)) {
            kept -= family.added(*image);
            beyond.push_back(image->id);
        }
    }
    return beyond;
}

} // namespace webots_cloud::core
