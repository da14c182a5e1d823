// The small pictures on a teacher's wall: how many bits a second they may take, and what counts as one.
#pragma once

#include <webots_cloud/time.hpp>

#include <cstddef>
#include <string_view>

namespace webots_cloud::core {

/// What is asked of each student's page.
struct PictureTerms
{
    std::chrono::milliseconds interval{}; ///< Between two pictures.
    int width = 160;
    int height = 120;
    std::size_t bytes = 2800; ///< Of JPEG; in base64 four thirds of it.

    bool operator==(PictureTerms const&) const = default;
};

/// For this many students: with what is told about them it takes less than 2 Mbit/s to the teacher, as 30
/// students do with two pictures a second each.
PictureTerms picture_terms(std::size_t students);

/// Whether a text is base64 (RFC 4648, section 4) of a JPEG of at most this many bytes and pixels. A browser
/// that decodes it takes memory for all pixels that the file claims to have.
bool is_picture_in_base64(std::string_view text, PictureTerms const& terms);

} // namespace webots_cloud::core
