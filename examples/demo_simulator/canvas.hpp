#pragma once

#include "camera.hpp"
#include "world_file.hpp"

#include <cairo.h>

#include <memory>
#include <span>
#include <string>

namespace webots_cloud::demo {

struct SurfaceDeleter
{
    void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using Surface = std::unique_ptr<cairo_surface_t, SurfaceDeleter>;

struct ContextDeleter
{
    void operator()(cairo_t* context) const { cairo_destroy(context); }
};

/// Where a text stands relative to its point.
enum class Anchor
{
    left,
    middle,
    right
};

/// Draws shapes of the scene, seen through a camera, and texts on a cairo surface.
class Canvas
{
public:
    Canvas(cairo_surface_t* surface, Camera const& camera) : context_(cairo_create(surface)), camera_(camera)
    {}

    Camera const& camera() const { return camera_; }
    cairo_t* raw() const { return context_.get(); }

    void fill(std::span<Point3 const> outline, Colour const& colour, double alpha = 1);
    void line(Point3 const& from, Point3 const& to, Colour const& colour, double alpha, double pixels);

    /// A horizontal disc.
    void disc(Point3 const& centre, double radius, Colour const& colour, double alpha = 1);

    /// A box that stands at height 0; only the faces that the camera sees.
    void box(Rectangle const& outline, double height, Colour const& colour, double alpha = 1);

    /// An upright cylinder with a lit top.
    void cylinder(Point centre, double bottom, double top, double radius, Colour const& colour);

    /// A wheel at `hub` whose axle points along `axis`, turned by `angle`, with visible spokes.
    void wheel(Point3 const& hub, Point axis, double radius, double thickness, double angle);

private:
    void path(std::span<Point3 const> outline);

    std::unique_ptr<cairo_t, ContextDeleter> context_;
    Camera const& camera_;
};

/// Text with a thin halo, `pixels` high. `text` must be valid UTF-8.
void draw_text(cairo_t* context, Point at, std::string const& text, double pixels, Anchor anchor,
               Colour const& colour, Colour const& halo);

/// Without its halo.
double text_width(cairo_t* context, std::string const& text, double pixels);

/// `colour` multiplied by `factor`: below 1 darker, above 1 brighter.
Colour shaded(Colour const& colour, double factor);

} // namespace webots_cloud::demo
