#include "simulation_findings.hpp"

#include "core/machine_labels.hpp"
#include "core/text.hpp"
#include "core/time_text.hpp"

namespace webots_cloud::core {
namespace {

std::string listed(std::vector<std::string> const& texts, std::string_view separator)
{
    return join({texts.begin(), texts.end()}, separator);
}

} // namespace

Finding judge_simulator(result<SimulatorReading> const& reading)
{
    constexpr std::string_view subject = "simulator";
    constexpr std::string_view install = "Install Webots, or name its folder with \"webotsHome\".";
    if (!reading)
        return {Verdict::fault, subject, reading.error().message(), install};
    auto const program = reading->program.string();
    if (!reading->is_webots)
        return {Verdict::warning, subject,
                concat("no Webots is installed: ", program,
                       " is the demo simulator, which shows a few robots in an arena"),
                install};
    auto const release = webots_release(reading->version_text);
    if (release.empty())
        return {Verdict::warning, subject, concat(program, " does not say which release of Webots it is"),
                "Its folder should have resources/version.txt: see whether Webots is installed as a whole."};
    return {Verdict::ok, subject, concat("Webots ", release, ", ", program)};
}

Finding judge_attempt(std::string_view subject, std::string_view key, result<AttemptReading> const& reading)
{
    if (!reading)
        return {Verdict::fault, subject, reading.error().message(),
                concat("Install what is missing, or change ", key, " (docs/sandboxes.md).")};
    if (reading->warnings.empty())
        return {Verdict::ok, subject, reading->description};
    return {Verdict::warning, subject, concat(reading->description, ": ", listed(reading->warnings, " "))};
}

Finding judge_limits(std::string_view unkept)
{
    return {Verdict::warning, "limits", unkept.substr(0, unkept.find_last_not_of('.') + 1),
            "Run the server as its unit of systemd does, which gives it control groups."};
}

Finding judge_start(StartReading const& reading)
{
    constexpr std::string_view subject = "start";
    if (reading.outcome)
        return {Verdict::ok, subject,
                concat("the simulator has loaded an empty world within ", seconds_rounded_up(reading.took),
                       " s")};
    auto const why = reading.outcome.error().message();
    return {Verdict::fault, subject,
            concat("the simulator does not load an empty world: ",
                   std::string_view(why).substr(0, why.find_last_not_of('.') + 1),
                   reading.printed.empty() ? "" : "; it printed: ", listed(reading.printed, " | ")),
            "No visitor's start succeeds: what it printed and the lines above say why."};
}

Finding judge_graphics(GraphicsReading const& reading)
{
    constexpr std::string_view subject = "graphics";
    if (!reading.devices.empty() || !reading.models.empty())
        return {Verdict::ok, subject,
                concat(reading.models.empty() ? "a graphics processor that may be used" : reading.models,
                       reading.devices.empty() ? "" : ": ", listed(reading.devices, ", "))};
    if (!reading.closed.empty())
        return {Verdict::warning, subject,
                concat("there is a graphics processor, but this user may not use it: ",
                       listed(reading.closed, ", ")),
                "Put the user who runs the server into the groups render and video."};
    return {
        Verdict::warning, subject, "there is no graphics processor: Webots draws with the processor",
        "Each simulation then takes more of the processor. Where that is too much, add a graphics processor "
        "and its driver."};
}

Finding judge_renderer(result<std::string> const& printed)
{
    constexpr std::string_view subject = "renderer";
    constexpr std::string_view label = "OpenGL renderer string:";
    if (!printed)
        return {
            Verdict::warning, subject, concat("OpenGL can't be tried: ", printed.error().message()),
            "Let the server's user draw on this screen (xhost +si:localuser:NAME), or change \"display\"."};
    std::string_view name;
    for (auto const line : split(*printed, '\n'))
        if (auto const at = line.find(label); at != std::string_view::npos)
            name = trim(line.substr(at + label.size()));
    if (name.empty())
        return {Verdict::warning, subject, "glxinfo names no renderer",
                "Run glxinfo -B on this screen: Webots needs OpenGL."};
    bool const is_software = name.starts_with("llvmpipe") || name.starts_with("softpipe") ||
                             name.starts_with("Software Rasterizer");
    if (is_software)
        return {
            Verdict::warning, subject, concat("the processor draws, not a graphics processor: ", name),
            "Worlds with cameras are slow: install the driver of the graphics processor, if there is one."};
    return {Verdict::ok, subject, name};
}

Finding judge_docker(result<std::string> const& info)
{
    if (!info)
        return {Verdict::fault, "docker", info.error().message(),
                "Install and start Docker, let the user who runs the server use it (group docker), or set "
                "\"docker\" to false."};
    return {Verdict::ok, "docker", concat("version ", trim(*info))};
}

Finding judge_slurm(result<std::string> const& partitions, std::string_view state)
{
    if (!partitions)
        return {Verdict::fault, "slurm", partitions.error().message(),
                "Install Slurm's programs (slurm-client), let the user who runs the server submit jobs, or "
                "remove "
                "\"launcher\"."};
    if (trim(*partitions).empty())
        return {Verdict::fault, "slurm", "there is no partition that this user may use",
                "See sinfo, and \"partition\" of \"launcher\"."};
    return {
        Verdict::ok, "slurm",
        concat("it answers; whether the nodes see ", state, ", Webots and the programs, a first job shows")};
}

} // namespace webots_cloud::core
