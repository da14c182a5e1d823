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
    {"--port", "=<1..65535>", "TCP port of the stream (1234; the next ten are tried when it is busy)"},
    {"--stream", "[=w3d|x3d|mjpeg]", "what to stream: scene updates (default) or pictures"},
    {"--stream", "=\"port=<p>;...\"", "the same in the spelling of R2021b and older"},
    {"--mode", "=pause|realtime|fast", "how to start (realtime)"},
    {"--heartbeat", "[=<ms>]", "time between the '.' lines on stdout (1000)"},
    {"--stdout", "", "write the robots' console lines to stdout too"},
    {"--extern-urls", "", "write to stdout where controllers connect that somebody else starts"},
    {"--demo-address", "=<ip>", "address to listen on (all); also WEBOTS_DEMO_ADDRESS"},
    {"--demo-faults", "=<list>", "misbehave, as --help says at its end; also WEBOTS_DEMO_FAULTS"},
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
