// The options of the demo simulator, for its usage text and its manual page. They are those of Webots, but
// for --demo-….
#pragma once

namespace webots_cloud::demo {

struct ProgramOption
{
    char const* name;  ///< With dashes.
    char const* value; ///< What follows it without a blank; empty: nothing does.
    char const* summary;
};

inline constexpr ProgramOption program_options[] = {
    {"--port", "=<1..65535>", "port of the stream (1234, or one of the next ten)"},
    {"--stream", "[=w3d|x3d|mjpeg]", "the scene (default), or pictures"},
    {"--stream", "=\"port=<p>;...\"", "the same, as R2021b and older spell it"},
    {"--mode", "=pause|realtime|fast", "how to start (realtime)"},
    {"--heartbeat", "[=<ms>]", "time between the '.' lines on stdout (1000)"},
    {"--stdout", "", "write the robots' console lines to stdout too"},
    {"--extern-urls", "", "print where controllers of others connect"},
    {"--demo-address", "=<ip>", "where it listens (all); also WEBOTS_DEMO_ADDRESS"},
    {"--demo-faults", "=<list>", "misbehave, see below; also WEBOTS_DEMO_FAULTS"},
    {"--help", "", "show this text"},
    {"--version", "", "show the version"},
    {"--sysinfo", "", "show what the simulator knows of the machine"},
};

/// Accepted, since Webots has them, and without effect.
inline constexpr ProgramOption ignored_options[] = {
    {"--batch", "", ""},
    {"--minimize", "", ""},
    {"--no-rendering", "", ""},
    {"--fullscreen", "", ""},
    {"--stderr", "", ""},
    {"--no-sandbox", "", ""},
    {"--log-performance", "=<..>", ""},
};

} // namespace webots_cloud::demo
