// Draws solids as a camera sees them, with cairo: outlines, the shades of their sides, and texts.
// picture.cpp says which ones.
#include "canvas.hpp"

#include <algorithm>
#include <array>
#include <numbers>

namespace webots_cloud::demo {
namespace {

constexpr std::size_t circle_points = 40;
using Circle = std::array<Point3, circle_points>;

double circle_angle(std::size_t i)
{
    return 2 * std::numbers::pi * static_cast<double>(i) / circle_points;
}

Circle flat_circle(Point3 const& centre, double radius)
{
    Circle circle;
    for (std::size_t i = 0; i < circle_points; ++i) {
        Point const edge = radius * unit(circle_angle(i));
        circle[i] = {centre.x + edge.x, centre.y + edge.y, centre.z};
    }
    return circle;
}

Circle upright_circle(Point3 const& centre, Point along, double radius)
{
    Circle circle;
    for (std::size_t i = 0; i < circle_points; ++i) {
        Point const edge = radius * unit(circle_angle(i));
        circle[i] = {centre.x + edge.x * along.x, centre.y + edge.x * along.y, centre.z + edge.y};
    }
    return circle;
}

} // namespace

Colour shaded(Colour const& colour, double factor)
{
    auto const scale = [factor](double v) { return std::clamp(v * factor, 0.0, 1.0); };
    return {scale(colour.red), scale(colour.green), scale(colour.blue)};
}

void Canvas::path(std::span<Point3 const> outline)
{
    cairo_new_path(raw());
    for (Point3 const& point : outline) {
        Point const p = camera_.project(point);
        cairo_line_to(raw(), p.x, p.y);
    }
    cairo_close_path(raw());
}

void Canvas::fill(std::span<Point3 const> outline, Colour const& colour, double alpha)
{
    path(outline);
    cairo_set_source_rgba(raw(), colour.red, colour.green, colour.blue, alpha);
    cairo_fill(raw());
}

void Canvas::line(Point3 const& from, Point3 const& to, Colour const& colour, double alpha, double pixels)
{
    Point const a = camera_.project(from);
    Point const b = camera_.project(to);
    cairo_new_path(raw());
    cairo_move_to(raw(), a.x, a.y);
    cairo_line_to(raw(), b.x, b.y);
    cairo_set_line_width(raw(), pixels);
    cairo_set_source_rgba(raw(), colour.red, colour.green, colour.blue, alpha);
    cairo_stroke(raw());
}

void Canvas::disc(Point3 const& centre, double radius, Colour const& colour, double alpha)
{
    fill(flat_circle(centre, radius), colour, alpha);
}

void Canvas::box(Rectangle const& outline, double height, Colour const& colour, double alpha)
{
    Point const h = outline.half;
    std::array<Point, 4> const corners{outline.to_world({h.x, h.y}), outline.to_world({-h.x, h.y}),
                                       outline.to_world({-h.x, -h.y}), outline.to_world({h.x, -h.y})};
    Point3 const& eye = camera_.position();
    for (std::size_t i = 0; i < 4; ++i) {
        Point const a = corners[i];
        Point const b = corners[(i + 1) % 4];
        Point const outwards{b.y - a.y, a.x - b.x}; // the corners run anticlockwise
        if (dot(outwards, Point{eye.x, eye.y} - a) <= 0)
            continue;
        Point const normal = (1 / std::max(length(outwards), 1e-9)) * outwards;
        double const light = 0.72 + 0.14 * dot(normal, unit(-2.2));
        std::array<Point3, 4> const face{
            Point3{a.x, a.y, 0}, {b.x, b.y, 0}, {b.x, b.y, height}, {a.x, a.y, height}};
        fill(face, shaded(colour, light), alpha);
    }
    std::array<Point3, 4> top;
    for (std::size_t i = 0; i < 4; ++i)
        top[i] = {corners[i].x, corners[i].y, height};
    if (eye.z > height)
        fill(top, shaded(colour, 1.08), alpha);
}

void Canvas::cylinder(Point centre, double bottom, double top, double radius, Colour const& colour)
{
    Circle const low = flat_circle({centre.x, centre.y, bottom}, radius);
    Circle const high = flat_circle({centre.x, centre.y, top}, radius);
    auto const by_x = [this](Point3 const& a, Point3 const& b) {
        return camera_.project(a).x < camera_.project(b).x;
    };
    std::size_t const left =
        static_cast<std::size_t>(std::min_element(low.begin(), low.end(), by_x) - low.begin());
    std::size_t const right =
        static_cast<std::size_t>(std::max_element(low.begin(), low.end(), by_x) - low.begin());
    double const left_x = camera_.project(low[left]).x;
    double const right_x = camera_.project(low[right]).x;

    std::unique_ptr<cairo_pattern_t, decltype(&cairo_pattern_destroy)> const shine(
        cairo_pattern_create_linear(left_x, 0, right_x, 0), &cairo_pattern_destroy);
    auto const stop = [&](double offset, double light) {
        Colour const c = shaded(colour, light);
        cairo_pattern_add_color_stop_rgb(shine.get(), offset, c.red, c.green, c.blue);
    };
    stop(0, 0.6);
    stop(0.35, 0.95);
    stop(1, 0.5);
    cairo_set_source(raw(), shine.get());
    path(low);
    cairo_fill(raw());
    path(std::array<Point3, 4>{low[left], low[right], high[right], high[left]});
    cairo_fill(raw());
    fill(high, shaded(colour, 1.06));
}

void Canvas::wheel(Point3 const& hub, Point axis, double radius, double thickness, double angle)
{
    Colour const tyre{0.13, 0.14, 0.16};
    Point3 const& eye = camera_.position();
    double const towards_eye = dot(axis, {eye.x - hub.x, eye.y - hub.y}) > 0 ? 1 : -1;
    Point const along{axis.y, -axis.x}; // the direction in which the wheel rolls
    auto const side = [&](double part) {
        double const offset = part * towards_eye * thickness / 2;
        return Point3{hub.x + offset * axis.x, hub.y + offset * axis.y, hub.z};
    };
    // Slices from the far side to the near one make the tread.
    for (double const part : {-1.0, -0.5, 0.0, 0.5, 1.0})
        fill(upright_circle(side(part), along, radius), shaded(tyre, part < 1 ? 0.8 : 1.3));
    Point3 const face = side(1);
    fill(upright_circle(face, along, 0.62 * radius), {0.72, 0.74, 0.78});
    for (int spoke = 0; spoke < 3; ++spoke) {
        // Rolling forwards turns the upper half of the wheel forwards.
        Point const tip = 0.62 * radius * unit(-angle + spoke * 2 * std::numbers::pi / 3);
        line(face, {face.x + tip.x * along.x, face.y + tip.x * along.y, face.z + tip.y}, tyre, 1,
             std::max(1.0, 0.012 * camera_.scale(face)));
    }
}

void draw_text(cairo_t* context, Point at, std::string const& text, double pixels, Anchor anchor,
               Colour const& colour, Colour const& halo)
{
    double const width = text_width(context, text, pixels);
    double const shift = anchor == Anchor::left ? 0 : anchor == Anchor::middle ? 0.5 : 1;
    cairo_new_path(context);
    cairo_move_to(context, at.x - shift * width, at.y);
    cairo_text_path(context, text.c_str());
    cairo_set_line_join(context, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(context, std::max(2.0, pixels / 6));
    cairo_set_source_rgba(context, halo.red, halo.green, halo.blue, 0.75);
    cairo_stroke_preserve(context);
    cairo_set_source_rgb(context, colour.red, colour.green, colour.blue);
    cairo_fill(context);
}

double text_width(cairo_t* context, std::string const& text, double pixels)
{
    cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_BOLD);
    cairo_set_font_size(context, pixels);
    cairo_text_extents_t extents;
    cairo_text_extents(context, text.c_str(), &extents);
    return extents.x_advance;
}

} // namespace webots_cloud::demo
