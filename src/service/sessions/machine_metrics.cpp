#include "machine_metrics.hpp"

#include "core/pages/metrics_text.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace webots_cloud {
namespace asio = boost::asio;

namespace {

constexpr auto every = std::chrono::seconds(1);
constexpr auto written_ahead = std::chrono::seconds(3); // one of these is missed without harm
constexpr auto pause = std::chrono::milliseconds(1);
constexpr std::size_t at_once = 250; // machines: less than half a millisecond

} // namespace

/// The figures of machines as they are written: each family is one text, since Prometheus wants its lines
/// together.
class MachineMetrics::Families
{
public:
    Families() { begin(); }

    /// Anew, in the same memory: of thousands of machines it is megabytes, which the kernel has to clear
    /// where it gives us others.
    void begin()
    {
        for (auto* const each : {&up_, &load_, &simulations_, &most_, &drained_, &placements_})
            each->clear();
        up_.family(core::metric("machine_up"));
        load_.family(core::metric("machine_load_ratio"));
        simulations_.family(core::metric("machine_simulations"));
        most_.family(core::metric("machine_simulations_max"));
        drained_.family(core::metric("machine_drained"));
        placements_.family(core::metric("machine_placements_total"));
    }

    void add(ServerLoad const& server, bool is_drained, std::uint64_t placed)
    {
        auto const labels = core::MetricsText::labels_text({{"machine", server.address}});
        auto const& report = server.report;
        if (server.state != ServerState::unknown)
            up_.add_labelled(server.state == ServerState::up ? 1 : 0, labels);
        // What a machine that is not up has reported before is not so any more.
        if (server.state == ServerState::up) {
            load_.add_labelled(report.load / 100, labels);
            if (report.sessions)
                simulations_.add_labelled(*report.sessions, labels);
            if (report.capacity)
                most_.add_labelled(*report.capacity, labels);
        }
        drained_.add_labelled(report.draining || is_drained ? 1 : 0, labels);
        placements_.add_labelled(static_cast<double>(placed), labels);
    }

    void write_to(std::string& text) const
    {
        text.clear();
        for (auto const* const each : {&up_, &load_, &simulations_, &most_, &drained_, &placements_})
            text += each->text();
    }

private:
    core::MetricsText up_;
    core::MetricsText load_;
    core::MetricsText simulations_;
    core::MetricsText most_;
    core::MetricsText drained_;
    core::MetricsText placements_;
};

bool MachineMetrics::is_large() const noexcept
{
    return site_.monitor.servers().size() > at_once;
}

void MachineMetrics::add(ServerLoad const& server, Families& families) const
{
    auto const* const machine = site_.fleet.find(server.address);
    families.add(server, machine && machine->is_draining(), site_.scheduler.placed(server.address));
}

std::string const& MachineMetrics::text()
{
    auto const now = site_.clock.now();
    if (made_ && now - *made_ < (is_large() ? Duration(written_ahead) : Duration(every)))
        return text_;
    Families families;
    for (auto const& server : site_.monitor.servers())
        add(server, families);
    families.write_to(text_);
    made_ = now;
    return text_;
}

void MachineMetrics::expire() noexcept
{
    made_.reset();
    ++expiries_;
}

asio::awaitable<result<>> MachineMetrics::run()
{
    Families families;
    std::string next;
    std::vector<std::string> addresses;
    for (;;) {
        if (auto const waited = co_await site_.clock.wait_until(site_.clock.now() + every); !waited)
            co_return waited;
        if (!is_large())
            continue;
        auto const began = site_.clock.now();
        auto const expiries = expiries_;
        // Machines may come and go meanwhile.
        addresses.resize(site_.monitor.servers().size());
        std::ranges::transform(site_.monitor.servers(), addresses.begin(), &ServerLoad::address);
        families.begin();
        // In parts, between which the event loop has its turn.
        for (std::size_t i = 0; expiries == expiries_ && i < addresses.size(); ++i) {
            if (auto const* const server = site_.monitor.find(addresses[i]))
                add(*server, families);
            if (i % at_once != at_once - 1)
                continue;
            if (auto const waited = co_await site_.clock.wait_until(site_.clock.now() + pause); !waited)
                co_return waited;
        }
        // Whoever has expired the text wants to see what is so now, and the first parts are from before.
        if (expiries != expiries_)
            continue;
        families.write_to(next);
        std::swap(text_, next);
        // As old as its oldest figure.
        made_ = began;
    }
}

} // namespace webots_cloud
