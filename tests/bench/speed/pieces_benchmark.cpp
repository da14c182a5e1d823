// What the parsers and writers of messages cost, each alone; placement has a benchmark of its own
// (tests/bench/placement_simulation).
#include "adapters/messages/http_request_reader.hpp"
#include "adapters/messages/http_response_text.hpp"
#include "adapters/messages/websocket_frames.hpp"
#include "core/git/git_pkt_line.hpp"
#include "core/pages/http_pages.hpp"

#include <webots_cloud/load_report.hpp>
#include <webots_cloud/project_ref.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <string>
#include <vector>

namespace {

using namespace webots_cloud;
using benchmark::DoNotOptimize;

/// A browser's frame: masked.
std::string masked_frame(std::string const& text)
{
    std::string plain;
    adapters::append_text_frame(plain, text);
    auto const header = plain.size() - text.size();
    std::string frame = plain.substr(0, header);
    frame[1] = static_cast<char>(frame[1] | 0x80);
    frame += "\x01\x02\x03\x04";
    for (std::size_t i = 0; i != text.size(); ++i)
        frame += static_cast<char>(text[i] ^ static_cast<char>(i % 4 + 1));
    return frame;
}

void set_bytes(benchmark::State& state, std::size_t each)
{
    state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations()) * static_cast<std::int64_t>(each));
}

void read_request(benchmark::State& state)
{
    std::string text = "GET /session HTTP/1.1\r\nHost: localhost:1999\r\n";
    for (int field = 0; field != state.range(0); ++field)
        text += "X-Field-" + std::to_string(field) + ": some value, as long as most of them are\r\n";
    text += "\r\n";
    adapters::HttpRequestReader reader;
    for (auto _ : state) {
        auto const room = reader.prepare();
        std::copy(text.begin(), text.end(), room.begin());
        reader.commit(text.size());
        DoNotOptimize(reader.parse());
        reader.next();
    }
    set_bytes(state, text.size());
}

void write_response(benchmark::State& state)
{
    auto const response = core::page("ws://simulation.example.org:2000");
    std::string out;
    for (auto _ : state) {
        out.clear();
        adapters::append_response(out, response, true, true);
        DoNotOptimize(out.data());
    }
}

void read_load_report(benchmark::State& state, std::string const& body)
{
    for (auto _ : state)
        DoNotOptimize(parse_load_report(body));
}

void read_world_url(benchmark::State& state)
{
    std::vector<ForgeAddress> const forges = {"https://github.com"};
    for (auto _ : state)
        DoNotOptimize(parse_world_url(
            "https://github.com/owner/repository/blob/main/projects/robots/worlds/arena.wbt", forges));
}

void read_frame(benchmark::State& state)
{
    auto const frame = masked_frame(std::string(static_cast<std::size_t>(state.range(0)), 'x'));
    adapters::WebSocketFrameReader reader(1 << 20);
    for (auto _ : state) {
        std::string_view bytes = frame;
        DoNotOptimize(reader.next(bytes));
    }
    set_bytes(state, frame.size());
}

void write_frame(benchmark::State& state)
{
    std::string const text(static_cast<std::size_t>(state.range(0)), 'x');
    std::string out;
    for (auto _ : state) {
        out.clear();
        adapters::append_text_frame(out, text);
        DoNotOptimize(out.data());
    }
    set_bytes(state, text.size());
}

void read_pkt_lines(benchmark::State& state)
{
    std::string text;
    for (int line = 0; line != 100; ++line)
        text += core::pkt_line("4b825dc642cb6eb9a060e54bf8d69288fbee4904 refs/heads/branch\n");
    for (auto _ : state) {
        core::PktLineDecoder decoder;
        decoder.push(text);
        for (int line = 0; line != 100; ++line)
            DoNotOptimize(decoder.next());
    }
    state.SetItemsProcessed(100 * static_cast<std::int64_t>(state.iterations()));
}

void write_pkt_line(benchmark::State& state)
{
    for (auto _ : state)
        DoNotOptimize(core::pkt_line("want 4b825dc642cb6eb9a060e54bf8d69288fbee4904\n"));
}

BENCHMARK(read_request)->Arg(3)->Arg(20);
BENCHMARK(write_response);
BENCHMARK_CAPTURE(read_load_report, bare_number, "12.5");
BENCHMARK_CAPTURE(
    read_load_report, json,
    R"({"load":12.5,"sessions":3,"starting":1,"capacity":16,"memory":41.5,"draining":false,"version":"1.0.0"})");
BENCHMARK(read_world_url);
BENCHMARK(read_frame)->Arg(5)->Arg(1000)->Arg(64 * 1024);
BENCHMARK(write_frame)->Arg(5)->Arg(64 * 1024);
BENCHMARK(read_pkt_lines);
BENCHMARK(write_pkt_line);

} // namespace

BENCHMARK_MAIN();
