// What builds make in docker, and how large it is: images, one for each step, of which each contains those
// before it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace webots_cloud::core {

/// The names of what one build makes, as its output has them: docker prints the number of each step's
/// container, and of its image, in a line of its own. A step that prints such lines itself can add names, but
/// hide none.
class BuildRecord
{
public:
    /// A line of compose.
    void read(std::string_view line);

    /// The first 12 digits of each.
    std::set<std::string> const& names() const noexcept { return names_; }
    /// It has named more than any build makes, so not all are known.
    bool is_full() const noexcept { return full_; }

private:
    std::set<std::string> names_;
    bool full_ = false;
};

/// An image as docker describes it.
struct BuiltImage
{
    BuiltImage() = default;

    std::string id;         ///< `sha256:...`, with all digits.
    std::string parent;     ///< The image of the step before; empty: none, or docker does not say.
    std::uint64_t size = 0; ///< Bytes, with all steps before it.
    std::string created;    ///< The later one is the greater text.
};

/// The arguments of docker that print the numbers of all images of the machine.
std::vector<std::string> list_image_ids();
/// The same, of what builds of this server have made alone.
std::vector<std::string> list_built_ids(std::string_view identity);

/// The images of such a listing; with `names` those alone that a build has named.
std::vector<std::string> image_ids(std::string_view listing);
std::vector<std::string> image_ids(std::string_view listing, std::set<std::string> const& names);

/// The arguments of docker that describe images, as `read_images` reads it.
std::vector<std::string> describe_images(std::vector<std::string> const& ids);

std::vector<BuiltImage> read_images(std::string_view description);

/// What the steps of these images have added, each counted once. Images without an earlier one among them add
/// nothing: they are what others start from, and the first step of a build, a label.
std::uint64_t added_bytes(std::vector<BuiltImage> const& images);

/// Which images are to go, in this order, so that what is kept adds no more than `max` bytes: what was built
/// first, with all its steps that no other build has, and nothing that running builds have named.
std::vector<std::string> images_beyond(std::vector<BuiltImage> const& images, std::uint64_t max,
                                       std::set<std::string> const& in_use);

} // namespace webots_cloud::core
