#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

/// The text frames that a browser sends to the simulator, taken apart.
namespace webots_cloud::demo::message {

struct PictureSize
{
    int width = 0;
    int height = 0;
};

struct JoinScene ///< `x3d`, `w3d`, `x3dom`, each also with `;broadcast`
{
    bool broadcast = false;
};
struct JoinPictures ///< `mjpeg: <W>x<H>`
{
    PictureSize size;
};
struct Pause
{};
struct Run ///< `real-time:<ms>`, `fast:<ms>`
{
    bool fast = false;
    std::int64_t duration = -1;
};
struct Step
{};
struct Timeout ///< `timeout:<ms>`
{
    std::int64_t duration = -1;
};
struct Reset
{};
struct Reload ///< `reload`, formerly `revert`
{};
struct Load ///< `load:<name>`; directories in the name are dropped
{
    std::string name;
};
struct Resize ///< `resize: <W>x<H>`
{
    PictureSize size;
};
struct Mouse ///< `mouse <type> <button> <buttons> <x> <y> <mod> <wheel>`
{
    int type = 0; ///< -1 press, 0 move, 1 release, 2 wheel
    int buttons = 0;
    double x = 0;
    double y = 0;
    double wheel = 0;
};
struct Ignored ///< known, and without effect here: `touch`, `follow`, robot window messages
{};
struct GetController ///< `get controller:<name>`; `sync controller:<name>/<file>` asks for one file
{
    std::string name;
    std::string file; ///< empty: all
};
struct SetController ///< `set controller:<name>/<file>:<lines>LF<content>`
{
    std::string name;
    std::string file;
    std::string content;
};
struct ToRobot ///< `robot:<name>:<text>` or `robot:{"name":"..","message":".."}`
{
    std::string name;
    std::string text;
};
struct Unsupported
{};

using Message = std::variant<Unsupported, JoinScene, JoinPictures, Pause, Run, Step, Timeout, Reset, Reload,
                             Load, Resize, Mouse, Ignored, ToRobot, GetController, SetController>;

/// Reads any text; what is not understood is Unsupported. Picture sizes are at least 1x1.
Message parse(std::string_view text);

} // namespace webots_cloud::demo::message
