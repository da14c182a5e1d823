// The picture of an arena, painted from what is far to what is near, so that things hide each other.
// canvas.cpp draws the solids, jpeg.cpp packs the picture.
#include "picture.hpp"

#include "canvas.hpp"
#include "jpeg.hpp"
#include "text.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace webots_cloud::demo {
namespace {

using namespace robot_model;

constexpr Colour ink{0.13, 0.17, 0.23};
constexpr Colour paper{1, 1, 1};
constexpr Colour wall_colour{0.60, 0.66, 0.74};
constexpr double wall_thickness = 0.04;

/// The four walls, each with the direction in which its inner face looks.
struct Wall
{
    Rectangle outline;
    Point inwards;
};

std::array<Wall, 4> walls_of(World const& world)
{
    Point const half = 0.5 * world.size;
    constexpr double t = wall_thickness / 2;
    return {Wall{{{{0, half.y + t}, 0}, {half.x + 2 * t, t}}, {0, -1}},
            Wall{{{{0, -half.y - t}, 0}, {half.x + 2 * t, t}}, {0, 1}},
            Wall{{{{half.x + t, 0}, 0}, {t, half.y}}, {-1, 0}},
            Wall{{{{-half.x - t, 0}, 0}, {t, half.y}}, {1, 0}}};
}

/// True when the camera sees the wall's inner face, so that nothing inside the arena is behind it.
bool is_far(Wall const& wall, Camera const& camera)
{
    Point const eye{camera.position().x, camera.position().y};
    return dot(wall.inwards, eye - wall.outline.pose.position) > 0;
}

void draw_walls(Canvas& canvas, World const& world, bool far)
{
    for (Wall const& wall : walls_of(world))
        if (is_far(wall, canvas.camera()) == far)
            canvas.box(wall.outline, world.wall_height, wall_colour, far ? 1 : 0.55);
}

void draw_floor(Canvas& canvas, World const& world)
{
    Point const half = 0.5 * world.size;
    std::array<Point3, 4> const floor{
        Point3{-half.x, -half.y, 0}, {half.x, -half.y, 0}, {half.x, half.y, 0}, {-half.x, half.y, 0}};
    canvas.fill(floor, {0.955, 0.96, 0.97});
    Colour const dark{0.88, 0.90, 0.925};
    for (Rectangle const& tile : dark_tiles(half)) {
        Point const low = tile.pose.position - tile.half;
        Point const high = tile.pose.position + tile.half;
        canvas.fill(
            std::array<Point3, 4>{
                Point3{low.x, low.y, 0}, {high.x, low.y, 0}, {high.x, high.y, 0}, {low.x, high.y, 0}},
            dark);
    }
}

void draw_goals(Canvas& canvas, World const& world)
{
    for (GoalDescription const& goal : world.goals)
        canvas.box(goal.outline, 0, goal.colour, 0.8);
}

void draw_sky(cairo_t* context, int width, int height)
{
    std::unique_ptr<cairo_pattern_t, decltype(&cairo_pattern_destroy)> const sky(
        cairo_pattern_create_linear(0, 0, 0, height), &cairo_pattern_destroy);
    cairo_pattern_add_color_stop_rgb(sky.get(), 0, 0.80, 0.87, 0.94);
    cairo_pattern_add_color_stop_rgb(sky.get(), 1, 0.93, 0.95, 0.97);
    cairo_set_source(context, sky.get());
    cairo_rectangle(context, 0, 0, width, height);
    cairo_fill(context);
}

/// Rays from green (free) to red (near).
void draw_sensor_rays(Canvas& canvas, Robot const& robot)
{
    constexpr double level = 0.045;
    for (std::size_t i = 0; i < sensor_angles.size(); ++i) {
        Point const direction = unit(robot.pose.heading + sensor_angles[i]);
        Point const from = robot.pose.position + radius * direction;
        Point const to = robot.pose.position + (radius + robot.distances[i]) * direction;
        double const near = 1 - robot.distances[i] / sensor_range;
        Colour const colour{0.15 + 0.75 * near, 0.70 - 0.5 * near, 0.25};
        Point3 const end{to.x, to.y, level};
        canvas.line({from.x, from.y, level}, end, colour, 0.4 + 0.5 * near, 1.3 + near);
        if (near > 0)
            canvas.disc(end, 0.011, colour, 0.9);
    }
}

void draw_wheel(Canvas& canvas, Robot const& robot, double side)
{
    Point const axis = unit(robot.pose.heading + std::numbers::pi / 2);
    Point const hub = robot.pose.position + side * (axle / 2 + 0.012) * axis;
    canvas.wheel({hub.x, hub.y, wheel_radius}, axis, wheel_radius, 0.024,
                 side > 0 ? robot.rotation.left : robot.rotation.right);
}

void draw_body(Canvas& canvas, Robot const& robot)
{
    Point const position = robot.pose.position;
    constexpr double top = 0.02 + height;
    canvas.cylinder(position, 0.02, top, radius, robot.description.colour);
    auto const on_top = [&](double forwards, double leftwards) {
        Point const p = position + rotated({forwards, leftwards}, robot.pose.heading);
        return Point3{p.x, p.y, top};
    };
    canvas.fill(std::array<Point3, 4>{on_top(0.055, 0), on_top(-0.035, 0.038), on_top(-0.016, 0),
                                      on_top(-0.035, -0.038)},
                paper, 0.92);
}

void draw_robot(Canvas& canvas, Robot const& robot)
{
    Point3 const& eye = canvas.camera().position();
    Point const left = unit(robot.pose.heading + std::numbers::pi / 2);
    double const near_side = dot(left, Point{eye.x, eye.y} - robot.pose.position) > 0 ? 1 : -1;
    draw_wheel(canvas, robot, -near_side);
    draw_body(canvas, robot);
    draw_wheel(canvas, robot, near_side);
}

/// What stands in the arena, the farthest first: the near ones cover the far ones.
void draw_things(Canvas& canvas, Arena const& arena)
{
    struct Thing
    {
        double depth;
        std::function<void()> draw;
    };
    std::vector<Thing> things;
    auto const add = [&](Point at, std::function<void()> draw) {
        things.push_back({canvas.camera().depth({at.x, at.y, 0}), std::move(draw)});
    };
    for (BoxDescription const& box : arena.world().boxes)
        add(box.outline.pose.position, [&canvas, &box] { canvas.box(box.outline, box.height, box.colour); });
    for (Robot const& robot : arena.robots())
        add(robot.pose.position, [&canvas, &robot] { draw_robot(canvas, robot); });
    std::stable_sort(things.begin(), things.end(),
                     [](Thing const& a, Thing const& b) { return a.depth > b.depth; });
    for (Thing const& thing : things)
        thing.draw();
}

void draw_shadows(Canvas& canvas, Arena const& arena)
{
    for (BoxDescription const& box : arena.world().boxes) {
        Rectangle shadow = box.outline;
        shadow.pose.position = shadow.pose.position + Point{0.25 * box.height, 0.2 * box.height};
        canvas.box(shadow, 0, ink, 0.16);
    }
    for (Robot const& robot : arena.robots()) {
        Point const p = robot.pose.position;
        canvas.disc({p.x + 0.015, p.y + 0.012, 0}, 1.12 * radius, ink, 0.20);
    }
}

void draw_names(Canvas& canvas, Arena const& arena, double font)
{
    for (Robot const& robot : arena.robots()) {
        Point const p = robot.pose.position;
        Point at = canvas.camera().project({p.x, p.y, 0.02 + height});
        at.y -= 0.085 * canvas.camera().scale({p.x, p.y, height}) + 0.2 * font;
        draw_text(canvas.raw(), at, robot.description.name, font, Anchor::middle,
                  shaded(robot.description.colour, 0.75), paper);
    }
}

std::string time_text(std::int64_t milliseconds)
{
    std::array<char, 40> buffer{};
    auto const ms = static_cast<long long>(milliseconds);
    int const size = std::snprintf(buffer.data(), buffer.size(), "%lld:%02lld:%02lld.%03lld", ms / 3600000,
                                   ms / 60000 % 60, ms / 1000 % 60, ms % 1000);
    return std::string(buffer.data(), static_cast<std::size_t>(size));
}

/// The sign that a player shows for its state.
void draw_mode_sign(cairo_t* context, Mode mode, double x, double y, double size)
{
    cairo_new_path(context);
    cairo_set_source_rgb(context, ink.red, ink.green, ink.blue);
    auto const triangle = [&](double left) {
        cairo_move_to(context, left, y);
        cairo_line_to(context, left + 0.8 * size, y + size / 2);
        cairo_line_to(context, left, y + size);
        cairo_close_path(context);
    };
    if (mode == Mode::pause) {
        cairo_rectangle(context, x, y, 0.3 * size, size);
        cairo_rectangle(context, x + 0.55 * size, y, 0.3 * size, size);
    } else {
        triangle(x);
        if (mode == Mode::fast)
            triangle(x + 0.7 * size);
    }
    cairo_fill(context);
}

void draw_captions(Canvas& canvas, Arena const& arena, Mode mode, int width, int height, double font)
{
    double const margin = 0.8 * font;
    draw_text(canvas.raw(), {margin, margin + font}, arena.world().title, font, Anchor::left, ink, paper);
    double const right = width - margin - 2 * font;
    draw_text(canvas.raw(), {right, margin + font}, time_text(arena.time()), font, Anchor::right, ink, paper);
    draw_mode_sign(canvas.raw(), mode, right + 0.6 * font, margin + 0.2 * font, 0.85 * font);
    draw_text(canvas.raw(), {margin, height - margin}, "demo simulator", 0.8 * font, Anchor::left,
              {0.35, 0.40, 0.47}, paper);
}

Surface new_surface(int width, int height)
{
    Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
    if (cairo_surface_status(surface.get()) != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error("cannot create a picture: out of memory");
    return surface;
}

std::string encode(cairo_surface_t* surface)
{
    cairo_surface_flush(surface);
    return jpeg_from({cairo_image_surface_get_data(surface), cairo_image_surface_get_width(surface),
                      cairo_image_surface_get_height(surface), cairo_image_surface_get_stride(surface)});
}

} // namespace

struct Picture::Background
{
    Surface surface;
    View view;
    int width = 0;
    int height = 0;
    Point size;
    double wall_height = 0;

    bool fits(World const& world, View const& v, int w, int h) const
    {
        return width == w && height == h && view.turn == v.turn && view.tilt == v.tilt &&
               view.zoom == v.zoom && size.x == world.size.x && size.y == world.size.y &&
               wall_height == world.wall_height;
    }
};

Picture::Picture() = default;
Picture::~Picture() = default;

void Picture::resize(int width, int height)
{
    width_ = std::clamp(width, min_side, max_width);
    height_ = std::clamp(height, min_side, max_height);
}

void Picture::draw_background(Arena const& arena)
{
    if (background_ && background_->fits(arena.world(), view_, width_, height_))
        return;
    World const& world = arena.world();
    Camera const camera(view_, world.size + Point{2 * wall_thickness, 2 * wall_thickness}, world.wall_height,
                        width_, height_);
    auto fresh = std::make_unique<Background>();
    fresh->surface = new_surface(width_, height_);
    fresh->view = view_;
    fresh->width = width_;
    fresh->height = height_;
    fresh->size = world.size;
    fresh->wall_height = world.wall_height;
    Canvas canvas(fresh->surface.get(), camera);
    draw_sky(canvas.raw(), width_, height_);
    draw_floor(canvas, world);
    draw_walls(canvas, world, true);
    background_ = std::move(fresh);
}

std::string Picture::draw(Arena const& arena, Mode mode)
{
    draw_background(arena);
    World const& world = arena.world();
    Camera const camera(view_, world.size + Point{2 * wall_thickness, 2 * wall_thickness}, world.wall_height,
                        width_, height_);
    Surface const surface = new_surface(width_, height_);
    Canvas canvas(surface.get(), camera);
    cairo_set_source_surface(canvas.raw(), background_->surface.get(), 0, 0);
    cairo_paint(canvas.raw());
    double const font = std::clamp(std::min(width_, height_) / 30.0, 9.0, 26.0);
    draw_goals(canvas, world);
    draw_shadows(canvas, arena);
    for (Robot const& robot : arena.robots())
        draw_sensor_rays(canvas, robot);
    draw_things(canvas, arena);
    draw_walls(canvas, world, false);
    draw_names(canvas, arena, 0.75 * font);
    draw_captions(canvas, arena, mode, width_, height_, font);
    return encode(surface.get());
}

} // namespace webots_cloud::demo
