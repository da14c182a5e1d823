#pragma once

#include "arena.hpp"
#include "camera.hpp"
#include "playback.hpp"

#include <memory>
#include <string>

namespace webots_cloud::demo {

/// Draws an arena as a person sees it from above, and encodes the drawing as a JPEG file.
class Picture
{
public:
    static constexpr int min_side = 32;
    static constexpr int max_width = 1920;
    static constexpr int max_height = 1200;

    Picture();
    ~Picture();

    /// Sets the size of the following drawings, cut to the limits above.
    void resize(int width, int height);
    int width() const { return width_; }
    int height() const { return height_; }

    View& view() { return view_; }

    /// Draws the present state. Throws std::runtime_error when it cannot be encoded.
    std::string draw(Arena const& arena, Mode mode);

private:
    struct Background;

    void draw_background(Arena const& arena);

    int width_ = 640;
    int height_ = 480;
    View view_;
    std::unique_ptr<Background> background_; ///< the floor and the far walls, drawn once per view
};

} // namespace webots_cloud::demo
